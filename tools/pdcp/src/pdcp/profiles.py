"""Channel profiles and types in words (profile-layer.md 1 and 2): the reference tree of docs/profiles.md."""

from __future__ import annotations

import difflib
import functools
import re
from dataclasses import dataclass

from .profile_tree import PROFILES
from .protocol import TEXTS, TypeData, TypeSize

__all__ = ["Profile", "channel_value", "describe_type", "parse_profile", "profile_name", "profile_path", "profiles"]

_HEX_WORD = re.compile(r"0[xX]([0-9A-Fa-f]{1,4})|([0-9A-Fa-f]{4})[hH]?|([0-9A-Fa-f]{1,4})[hH]")


@dataclass(frozen=True, slots=True)
class Profile:
    """A node of the tree."""

    word: int
    path: str
    name: str
    means: str
    scale: str
    mode: str
    sign: str
    rate: str
    safe: str


@functools.cache
def profiles() -> dict[int, Profile]:
    """All nodes of the tree by their word, lowest first."""
    return {row[0]: Profile(*row) for row in PROFILES}


def _named(word: int) -> Profile | None:
    """The node itself or its nearest ancestor that has a name."""
    for mask in (0xFFFF, 0xFFF0, 0xFF00, 0xF000):
        node = profiles().get(word & mask)
        if node is not None:
            return node
    return None


def profile_name(word: int) -> str | None:
    """The name of a profile; for one that has none, its nearest ancestor's, as in `EMG amplitude > 2221h`. None:
    the null profile, or a root that is not in the tree."""
    node = _named(word)
    if node is None:
        return None
    return node.name if node.word == word else f"{node.name} > {word:04X}h"


def profile_path(word: int) -> str | None:
    """What parse_profile() takes for this profile, such as `emg.amplitude`; None: it has no name."""
    node = profiles().get(word)
    return None if node is None else node.path


def parse_profile(text: str) -> int:
    """The word of a path (`emg.amplitude`) or of a hexadecimal number (`2220`, `2220h`, `0x2220`).

    Raises ValueError with what is close to it."""
    match = _HEX_WORD.fullmatch(text.strip())
    if match:
        return int(match[1] or match[2] or match[3], 16)
    words = {node.path: node.word for node in profiles().values()}
    path = re.sub(r"[\s_/-]+", "_", text.strip().lower()).replace("_.", ".").replace("._", ".")
    if path in words:
        return words[path]
    close = difflib.get_close_matches(path, words, n=3, cutoff=0.5)
    hint = f", perhaps {' or '.join(close)}" if close else ""
    raise ValueError(f"{text!r} is neither the path of a profile nor a hexadecimal number{hint}")


def describe_type(word: int) -> str:
    """A channel type in words: `8 bits, unsigned, position, sole access, terminal`. What it must not be is marked."""
    size = word >> 14 & 3
    data = word >> 12 & 3
    prescaler = word >> 5 & 7
    words = [TEXTS["type_size"][size], TEXTS["type_data"][data], TEXTS["type_control"][word >> 10 & 3]]
    words += ["sole access"] if word & 0x0200 else []
    words += ["terminal"] if word & 0x0100 else []
    words += [TEXTS["type_prescaler"][prescaler]] if prescaler else []
    if data == TypeData.FLOAT and size != TypeSize.BITS_16:
        words.append("not allowed: float needs 16 bits")
    if word & 0x1F:
        words.append(f"unused bits {word & 0x1F:02X}h")
    return ", ".join(words)


def channel_value(word: int, data: bytes) -> int | bool | None:
    """What a frame of a channel of this type says; None: it is empty, or a float."""
    bits = 4 * ((word >> 14 & 3) + 1)
    kind = word >> 12 & 3
    number = int.from_bytes(data[: 1 if bits <= 8 else 2], "little") & ((1 << bits) - 1)
    if not data or kind == TypeData.FLOAT:
        return None
    if kind == TypeData.BOOLEAN:
        return bool(number)
    is_negative = kind == TypeData.SIGNED and number >> (bits - 1)
    return number - (1 << bits) if is_negative else number
