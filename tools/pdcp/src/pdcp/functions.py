"""Function codes of PDCP and what is in their frames (pdcp-bus.md 2)."""

from __future__ import annotations

from dataclasses import dataclass

from . import protocol

__all__ = ["FUNCTIONS", "Function", "Values", "code_class", "sizes_text", "split", "word_at"]


def word_at(data: bytes, at: int = 0, size: int = 2) -> int:
    """A little-endian number (D-BUS-1); missing bytes are 0."""
    return int.from_bytes(data[at : at + size], "little")


@dataclass(frozen=True, slots=True)
class Function:
    """What a function code stands for."""

    name: str
    sizes: tuple[int, ...]  # those of [PDCP 3.2]; one that only [PDCP 3.1] has stands behind (D-BUS-3)
    layout: tuple[tuple[str, int], ...] = ()  # name and bytes; 0: all that is left
    device: bool = False  # a device may send it
    arbitrator: bool = False
    deprecated: bool = False


FUNCTIONS = {
    code: Function(name, sizes, layout, "device" in senders, "arbitrator" in senders, deprecated)
    for code, name, sizes, layout, senders, deprecated in protocol.FUNCTIONS
}


def code_class(code: int) -> str:
    """What a code without a function of its own is [PDCP 3.1]."""
    for low, high, name in protocol.CODE_RANGES:
        if low <= code <= high:
            return name
    return "Unknown Code"


def sizes_text(sizes: tuple[int, ...]) -> str:
    ordered = sorted(sizes)
    if len(ordered) > 2 and ordered == list(range(ordered[0], ordered[-1] + 1)):
        return f"{ordered[0]} to {ordered[-1]} bytes"
    text = " or ".join(str(size) for size in ordered)
    return f"{text} byte" if ordered == [1] else f"{text} bytes"


class Values(dict[str, int]):
    """The numbers of a message by name, and the bytes at its end."""

    tail: bytes = b""


def split(function: Function, data: bytes) -> Values:
    """The fields that are there, by name."""
    values = Values()
    at = 1
    for name, size in function.layout:
        if size == 0:
            values.tail = data[at:]
        elif len(data) >= at + size:
            values[name] = word_at(data, at, size)
        at += size
    return values
