"""Parameters of devices and channels by name, and their values by field (pdcp-bus.md 4, profile-layer.md 2)."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from .profiles import describe_type, profile_name

__all__ = [
    "DIRECTIONS",
    "INPUT",
    "NO_CHANNEL",
    "ONLY_INPUTS",
    "OUTPUT",
    "Field",
    "Parameter",
    "channel_value",
    "count_text",
    "ms_text",
    "node_text",
    "parameter_of",
    "profile_text",
    "raw_text",
    "value_fields",
    "word_at",
]

Json: TypeAlias = "bool | int | str | list[int] | None"

INPUT, OUTPUT = 1, 2  # transfer types
DIRECTIONS = {INPUT: "input", OUTPUT: "output"}
NO_CHANNEL = 255  # source of an unconnected input (D-BUS-7)


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a frame: its value for machines, and as people read it."""

    name: str
    value: Json
    text: str


def _hex(digits: int) -> Callable[[int], str]:
    return lambda value: f"{value:0{digits}X}h"


def node_text(value: int) -> str:
    return f"{value:02X}h"


def profile_text(value: int) -> str:
    name = profile_name(value)
    return f"{value:04X}h ({name})" if name else f"{value:04X}h"


def _type_text(value: int) -> str:
    return f"{value:04X}h ({describe_type(value)})"


def _source_type_text(value: int) -> str:
    """Of an unconnected input it is 0 (D-BUS-7), which says nothing."""
    return _type_text(value) if value else "0000h"


def _source_channel_text(value: int) -> str:
    return "255 (none)" if value == NO_CHANNEL else str(value)


def ms_text(value: int) -> str:
    return f"{value} ms"


def _enabled(value: int) -> str:
    return {0: "0 (off)", 1: "1 (on)"}.get(value, f"{value} (neither 0 nor 1)")


def _transfer(value: int) -> str:
    return f"{value} ({DIRECTIONS.get(value, 'neither input nor output')})"


@dataclass(frozen=True, slots=True)
class _Part:
    name: str
    size: int
    text: Callable[[int], str] = str


@dataclass(frozen=True, slots=True)
class Parameter:
    name: str
    parts: tuple[_Part, ...] = ()
    form: str = "numbers"  # numbers, text, bits


_TYPE_PROFILE = (_Part("type", 2, _type_text), _Part("profile", 2, profile_text))

_DEVICE_PARAMETERS = {
    1: Parameter("VID, PID", (_Part("vid", 2, _hex(4)), _Part("pid", 2, _hex(4)))),
    2: Parameter("serial number", (_Part("serial", 2, _hex(4)),)),
    3: Parameter("EAN13L", (_Part("ean13_low", 4, _hex(8)),)),
    4: Parameter("EAN13H", (_Part("ean13_high", 4, _hex(8)),)),
    5: Parameter("versions", (_Part("firmware", 2), _Part("hardware", 2))),
    6: Parameter("type, profile", (_Part("type", 2, _hex(4)), _Part("profile", 2, _hex(4)))),
    7: Parameter("descriptor", form="text"),
    8: Parameter("device node id", (_Part("node", 1, node_text),)),
    9: Parameter("number of data channels", (_Part("channels", 1),)),
    10: Parameter("beacon interval", (_Part("interval", 2, ms_text),)),
    11: Parameter("acknowledgement time", (_Part("time", 2, ms_text),)),
    12: Parameter("bind request timeout", (_Part("timeout", 2, ms_text),)),
}
_CHANNEL_PARAMETERS = {
    1: Parameter("type, profile", _TYPE_PROFILE),
    2: Parameter("descriptor", form="text"),
    3: Parameter("transfer type", (_Part("transfer_type", 1, _transfer),)),
    4: Parameter("data transfer enabled", (_Part("enabled", 1, _enabled),)),
    9: Parameter("required input channels", form="bits"),
    10: Parameter("desired input channels", form="bits"),
}
_INPUT_PARAMETERS = {
    **_CHANNEL_PARAMETERS,
    5: Parameter("source VID, PID", (_Part("source_vid", 2, _hex(4)), _Part("source_pid", 2, _hex(4)))),
    6: Parameter(
        "source serial number, channel",
        (_Part("source_serial", 2, _hex(4)), _Part("source_channel", 1, _source_channel_text)),
    ),
    7: Parameter(
        "source node ids", (_Part("source_device_node", 1, node_text), _Part("source_output_node", 1, node_text))
    ),
    8: Parameter(
        "source type, profile", (_Part("source_type", 2, _source_type_text), _Part("source_profile", 2, profile_text))
    ),
    11: Parameter("terminal profile", (_Part("terminal_profile", 2, profile_text),)),
}
_OUTPUT_PARAMETERS = {
    **_CHANNEL_PARAMETERS,
    5: Parameter("channel node id", (_Part("node", 1, node_text),)),
}
ONLY_INPUTS = (6, 7, 8, 11)


def parameter_of(channel: int, number: int, direction: int) -> Parameter | None:
    """A parameter of the specification; None: it has none, or the direction of the channel decides. direction: 0
    while it is not known."""
    if channel == 0:
        return _DEVICE_PARAMETERS.get(number)
    if direction == OUTPUT:
        return _OUTPUT_PARAMETERS.get(number)
    if direction == INPUT or number in ONLY_INPUTS:
        return _INPUT_PARAMETERS.get(number)
    return _CHANNEL_PARAMETERS.get(number)


def word_at(data: bytes, at: int = 0, size: int = 2) -> int:
    """A little-endian number (D-BUS-1); missing bytes are 0."""
    return int.from_bytes(data[at : at + size], "little")


def count_text(size: int) -> str:
    return f"{size} byte" if size == 1 else f"{size} bytes"


def raw_text(data: bytes) -> str:
    return data.hex().upper() or "(empty)"


def _text_fields(data: bytes) -> list[Field]:
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        return [Field("text", None, f"{raw_text(data)} (no UTF-8)")]
    return [Field("text", text, json.dumps(text, ensure_ascii=not text.isprintable()))]


def _bits_fields(data: bytes) -> list[Field]:
    """D-BUS-8: the most significant bit of the first byte is channel index 0."""
    channels = [8 * at + bit for at, byte in enumerate(data) for bit in range(8) if byte << bit & 0x80]
    return [Field("channels", channels, " ".join(str(channel) for channel in channels) or "none")]


def value_fields(parameter: Parameter | None, data: bytes) -> list[Field]:
    """The typed fields of a value; missing bytes are 0, extra ones are named (pdcp-bus.md 4)."""
    if parameter is None:
        return [Field("value", data.hex().upper(), raw_text(data))]
    if parameter.form == "text":
        return _text_fields(data)
    if parameter.form == "bits":
        return _bits_fields(data)
    fields = []
    at = 0
    for part in parameter.parts:
        number = word_at(data, at, part.size)
        fields.append(Field(part.name, number, part.text(number)))
        at += part.size
    if len(data) < at:
        fields.append(Field("bytes_missing", at - len(data), str(at - len(data))))
    if len(data) > at:
        fields.append(Field("bytes_extra", data[at:].hex().upper(), raw_text(data[at:])))
    return fields


def channel_value(word: int, data: bytes) -> list[Field]:
    """The value of a frame by the channel's type (profile-layer.md 2); none for floats."""
    bits = 4 * ((word >> 14) + 1)
    kind = word >> 12 & 3
    number = word_at(data[: 1 if bits <= 8 else 2]) & ((1 << bits) - 1)
    if not data or kind == 2:
        return []
    if kind == 3:
        return [Field("value", bool(number), "true" if number else "false")]
    if kind == 0 and number >> (bits - 1):
        number -= 1 << bits
    return [Field("value", number, str(number))]
