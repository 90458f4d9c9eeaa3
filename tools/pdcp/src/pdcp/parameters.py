"""Parameters of devices and channels (pdcp-bus.md 4; [PROFILE tables 2.8 and 2.9 and 2.10]): names, units, layouts, and
their values as text."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from . import protocol
from .model import Direction, parse_number
from .profiles import describe_type, parse_profile, profile_name

BITS_MAX = 32 * 8  # channels that a required or desired string can name (D-BUS-8)


class Kind(StrEnum):
    """What has parameters."""

    DEVICE = "device"
    INPUT = "input"
    OUTPUT = "output"


class Style(StrEnum):
    """How a field is shown and read."""

    NUMBER = "number"
    MILLISECONDS = "milliseconds"
    NODE = "node"  # id
    WORD = "word"  # in hexadecimal
    TYPE = "type"  # of a channel
    PROFILE = "profile"
    SWITCH = "switch"
    TRANSFER = "transfer"  # transfer type


class Form(StrEnum):
    """How a whole value is laid out."""

    FIELDS = "fields"
    TEXT = "text"  # UTF-8 without a terminator
    CHANNELS = "channels"  # bit string; most significant bit of the first byte: channel 0 (D-BUS-8)


TRANSFER_KINDS = {number: Kind(name) for number, name in protocol.TEXTS["transfer"].items()}
_SWITCHES = {0: "off", 1: "on"}
_SHOWN_WORD = re.compile(r".* \(?([0-9A-F]{4}h)\)?")  # a type or a profile
_SHOWN_TIME = re.compile(r"(\S+) ?ms")

FieldValue = int | str | bool
Decoded = dict[str, FieldValue] | str | list[int]


@dataclass(frozen=True)
class Field:
    """Part of a value, LSB first."""

    name: str
    size: int  # bytes
    style: Style = Style.NUMBER

    @property
    def label(self) -> str:
        return self.name.replace("_", " ")

    def decode(self, number: int) -> FieldValue:
        if self.style is Style.SWITCH:
            return bool(number) if number in _SWITCHES else number
        if self.style is Style.TRANSFER and number in TRANSFER_KINDS:
            return str(TRANSFER_KINDS[number])
        return number

    def show(self, number: int) -> str:
        match self.style:
            case Style.WORD:
                return f"{number:04X}h"
            case Style.TYPE:
                return f"{describe_type(number)} ({number:04X}h)"
            case Style.PROFILE:
                return show_profile(number)
            case Style.MILLISECONDS:
                return f"{number} ms"
            case Style.SWITCH:
                return _SWITCHES.get(number, str(number))
            case Style.TRANSFER:
                return str(TRANSFER_KINDS.get(number, number))
            case _:
                return str(number)

    def bare(self, text: str) -> str | None:
        """What show() writes of a time, a type or a profile, without the words around it; None: it is none of these."""
        if self.style is Style.MILLISECONDS:
            found = _SHOWN_TIME.fullmatch(text)
        else:
            found = _SHOWN_WORD.fullmatch(text) if self.style in (Style.TYPE, Style.PROFILE) else None
        return found and found[1]

    def parse(self, text: str) -> bytes:
        """The bytes of what a user wrote, which may be what show() writes. Raises ValueError."""
        known: dict[Style, Mapping[int, str]] = {Style.SWITCH: _SWITCHES, Style.TRANSFER: TRANSFER_KINDS}
        words = {word: number for number, word in known.get(self.style, {}).items()}
        text = self.bare(text) or text
        if text.lower() in words:
            number = words[text.lower()]
        elif self.style is Style.PROFILE and not text.isdecimal() and not text.lower().startswith("0x"):
            number = parse_profile(text)
        elif self.style in (Style.WORD, Style.TYPE) and text[-1:] in ("h", "H"):
            number = parse_number(f"0x{text[:-1]}")
        else:
            number = parse_number(text)
        if not 0 <= number < 1 << 8 * self.size:
            raise ValueError(f"{number} is not between 0 and {(1 << 8 * self.size) - 1}")
        return number.to_bytes(self.size, "little")


@dataclass(frozen=True)
class Parameter:
    """One parameter of a kind of things."""

    kind: Kind
    number: int
    name: str
    fields: tuple[Field, ...] = ()
    form: Form = Form.FIELDS

    @property
    def size(self) -> int | None:
        """Bytes of a value; None: as long as it is."""
        return sum(field.size for field in self.fields) if self.form is Form.FIELDS else None

    def numbers(self, value: bytes) -> list[int]:
        """The number in each field; missing bytes are 0, extra ones are ignored."""
        numbers = []
        for field in self.fields:
            numbers.append(int.from_bytes(value[: field.size], "little"))
            value = value[field.size :]
        return numbers

    def decode(self, value: bytes) -> Decoded:
        """A value as plain data, for JSON: fields by name, a text, or a list of channels."""
        if self.form is Form.TEXT:
            return value.decode(errors="replace")
        if self.form is Form.CHANNELS:
            return channels_of(value)
        numbers = self.numbers(value)
        return {field.name: field.decode(number) for field, number in zip(self.fields, numbers, strict=True)}

    def is_no_source(self, value: bytes) -> bool:
        """Does it say of an input that it is not connected?"""
        return self.kind is Kind.INPUT and protocol.NO_SOURCE.get(self.number) == tuple(self.numbers(value))

    def show(self, value: bytes) -> str:
        """A value as people read it: one line, without control characters."""
        if self.form is Form.TEXT:
            return "".join(each if each.isprintable() else "\ufffd" for each in value.decode(errors="replace"))
        if self.form is Form.CHANNELS:
            return ", ".join(str(each) for each in channels_of(value)) or "none"
        if self.is_no_source(value):
            return "none"
        shown = [field.show(number) for field, number in zip(self.fields, self.numbers(value), strict=True)]
        if len(shown) == 1:
            return shown[0]
        if self.fields[0].style is Style.TYPE:
            return "; ".join(shown)
        return ", ".join(f"{field.label} {text}" for field, text in zip(self.fields, shown, strict=True))

    def _shown_words(self, text: str) -> list[str]:
        """The fields of a text as show() writes it, without their labels; empty: it is none."""
        if len(self.fields) == 1:
            return [text] if self.fields[0].bare(text) else []
        if self.fields[0].style is Style.TYPE:
            return text.split("; ") if "; " in text else []
        labelled = ", ".join(f"{re.escape(field.label)} (.+)" for field in self.fields)
        found = re.fullmatch(labelled, text)
        return list(found.groups()) if found else []

    def parse(self, words: Sequence[str]) -> bytes:
        """A value from what a user wrote: one word for each field, a text, channels, or what show() writes, in one
        word or several. Raises ValueError."""
        if self.form is Form.TEXT:
            return " ".join(words).encode()
        if self.form is Form.CHANNELS:
            names = [] if list(words) == ["none"] else [part for word in words for part in word.split(",") if part]
            return bits_of([parse_number(name) for name in names])
        if list(words) == ["none"] and self.kind is Kind.INPUT and self.number in protocol.NO_SOURCE:
            numbers = protocol.NO_SOURCE[self.number]
            return b"".join(n.to_bytes(field.size, "little") for n, field in zip(numbers, self.fields, strict=True))
        words = self._shown_words(" ".join(words)) or words
        if len(words) != len(self.fields):
            wanted = ", ".join(field.name for field in self.fields)
            values = "1 value" if len(self.fields) == 1 else f"{len(self.fields)} values"
            raise ValueError(f"{self.name} takes {values} ({wanted}), not {len(words)}")
        return b"".join(field.parse(word) for field, word in zip(self.fields, words, strict=True))


def show_profile(word: int) -> str:
    """A profile with its name, as far as it has one."""
    name = profile_name(word)
    return f"{name} ({word:04X}h)" if name and not name.endswith("h") else name or f"{word:04X}h"


def channels_of(bits: bytes) -> list[int]:
    """The channels whose bit is set."""
    return [8 * at + bit for at, byte in enumerate(bits) for bit in range(8) if byte & 0x80 >> bit]


def bits_of(channels: Sequence[int]) -> bytes:
    """The shortest string with these bits set, one byte at least."""
    bits = bytearray(max(channels, default=0) // 8 + 1)
    for channel in channels:
        if not 0 <= channel < BITS_MAX:
            raise ValueError(f"channel {channel} is not between 0 and {BITS_MAX - 1}")
        bits[channel // 8] |= 0x80 >> channel % 8
    return bytes(bits)


def _parameter(kind: str, number: int, name: str, fields: tuple[tuple[str, int, str], ...], form: str) -> Parameter:
    made = tuple(Field(part, size, Style(style)) for part, size, style in fields)
    return Parameter(Kind(kind), number, name, made, Form(form))


_ROWS = tuple(_parameter(*row) for row in protocol.PARAMETERS)
PARAMETERS = {kind: tuple(each for each in _ROWS if each.kind is kind) for kind in Kind}
_BY_NUMBER = {(each.kind, each.number): each for each in _ROWS}

TRANSFER_TYPE = 3  # parameter of a channel that says which kind it is


def kind_of(direction: Direction) -> Kind:
    return Kind.INPUT if direction is Direction.INPUT else Kind.OUTPUT


def by_number(kind: Kind, number: int) -> Parameter | None:
    """None: this kind has no such parameter, as far as the specification goes."""
    return _BY_NUMBER.get((kind, number))


def find(kind: Kind, text: str) -> Parameter | int:
    """A parameter by its number or name; a number that this kind does not have stays a number. Raises ValueError."""
    name = text.lower().replace("_", "-")
    for parameter in PARAMETERS[kind]:
        if parameter.name == name:
            return parameter
    if not text[:1].isdigit():
        names = ", ".join(parameter.name for parameter in PARAMETERS[kind])
        article = "a" if kind is Kind.DEVICE else "an"
        raise ValueError(f"{article} {kind} has no parameter '{text}'; it has {names}")
    number = parse_number(text)
    if not 0 <= number <= 0xFF:
        raise ValueError(f"parameter {number} is not between 0 and 255")
    return by_number(kind, number) or number
