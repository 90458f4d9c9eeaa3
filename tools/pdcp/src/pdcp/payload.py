"""What the messages of the host API (messages.py) are made of: fields, and kinds of messages [API 3.1, 3.2].

Each message is a dataclass whose fields are its payload, in the order of the wire; all are packed and unpacked by the
same few lines.
"""

import struct
from dataclasses import dataclass, fields
from typing import Annotated, Any, ClassVar, Generic, Self, TypeVar, cast, get_args, get_type_hints

from .model import ChannelId, Identity
from .wire import Frame


class FormatError(ValueError):
    """A payload, or a value for one, that does not fit its message."""


# --- fields ---


# How fields stand in a payload. take() returns the value at the front and how many bytes it has; it raises IndexError
# when there are too few.


@dataclass(frozen=True)
class _Unsigned:
    """A number, LSB first."""

    size: int

    def pack(self, value: int) -> bytes:
        try:
            return value.to_bytes(self.size, "little")
        except OverflowError:
            raise FormatError(f"{value} does not fit {8 * self.size} bits") from None

    def take(self, data: bytes) -> tuple[int, int]:
        if len(data) < self.size:
            raise IndexError
        return int.from_bytes(data[: self.size], "little"), self.size


class _Device:
    """VID, PID, SN."""

    _layout = struct.Struct("<HHH")

    def pack(self, value: Identity) -> bytes:
        try:
            return self._layout.pack(value.vid, value.pid, value.sn)
        except struct.error:
            raise FormatError(f"{value} does not fit three times 16 bits") from None

    def take(self, data: bytes) -> tuple[Identity, int]:
        if len(data) < self._layout.size:
            raise IndexError
        return Identity(*self._layout.unpack_from(data)), self._layout.size


class _ChannelOfDevice:
    """VID, PID, SN, channel index."""

    def pack(self, value: ChannelId) -> bytes:
        return _Device().pack(value.identity) + _Unsigned(1).pack(value.index)

    def take(self, data: bytes) -> tuple[ChannelId, int]:
        identity, size = _Device().take(data)
        return ChannelId(identity, data[size]), size + 1


@dataclass(frozen=True)
class _Bytes:
    """So many bytes; without a size all that are left, at least so many."""

    size: int | None = None
    least: int = 0

    def pack(self, value: bytes) -> bytes:
        if len(value) < self.least or (self.size is not None and len(value) != self.size):
            raise FormatError(f"{len(value)} bytes are not {self.size or f'{self.least} or more'}")
        return value

    def take(self, data: bytes) -> tuple[bytes, int]:
        size = len(data) if self.size is None else self.size
        if len(data) < max(size, self.least):
            raise IndexError
        return data[:size], size


class _Counters:
    """32-bit numbers to the end."""

    def pack(self, value: tuple[int, ...]) -> bytes:
        return b"".join(_Unsigned(4).pack(each) for each in value)

    def take(self, data: bytes) -> tuple[tuple[int, ...], int]:
        if len(data) % 4:
            raise IndexError
        return struct.unpack(f"<{len(data) // 4}I", data), len(data)


class _Mask:
    """One byte where that is enough, else two (D-API-20)."""

    def pack(self, value: int) -> bytes:
        return _Unsigned(1 if 0 <= value <= 0xFF else 2).pack(value)

    def take(self, data: bytes) -> tuple[int, int]:
        return _Unsigned(min(max(len(data), 1), 2)).take(data)


_Codec = _Unsigned | _Mask | _Device | _ChannelOfDevice | _Bytes | _Counters

U8 = Annotated[int, _Unsigned(1)]
U16 = Annotated[int, _Unsigned(2)]
U32 = Annotated[int, _Unsigned(4)]
Mask = Annotated[int, _Mask()]
Dev = Annotated[Identity, _Device()]
Chan = Annotated[ChannelId, _ChannelOfDevice()]
Octets = Annotated[bytes, _Bytes(8)]
Rest = Annotated[bytes, _Bytes()]
Value = Annotated[bytes, _Bytes(least=1)]
U32s = Annotated[tuple[int, ...], _Counters()]

# --- kinds of messages ---

MESSAGES: dict[int, type["Message"]] = {}  # by id

AnswerT = TypeVar("AnswerT", bound="Message", covariant=True)


class Message:
    """A message without its header."""

    ID: ClassVar[int]

    def __init_subclass__(cls, id: int | None = None) -> None:
        super().__init_subclass__()
        if id is not None:
            assert id not in MESSAGES, f"{id:04X}h twice"
            cls.ID = id
            MESSAGES[id] = cls

    def pack(self) -> bytes:
        """The payload. Raises FormatError when a value does not fit its field."""
        parts = []
        for name, codec in _layout(type(self)):
            try:
                parts.append(codec.pack(getattr(self, name)))
            except FormatError as error:
                raise FormatError(f"{type(self).__name__}, {name}: {error}") from None
        return b"".join(parts)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Reads a payload. Raises FormatError when its size is wrong."""
        values: dict[str, Any] = {}
        at = 0
        try:
            for name, codec in _layout(cls):
                values[name], size = codec.take(payload[at:])
                at += size
        except IndexError:
            at = -1
        if at != len(payload):
            raise FormatError(f"{cls.ID:04X}h cannot have {len(payload)} bytes: {payload.hex(' ') or 'none'}")
        return cls(**values)


_layouts: dict[type[Message], list[tuple[str, _Codec]]] = {}


def _layout(kind: type[Message]) -> list[tuple[str, _Codec]]:
    """Names of the fields of a class, and how they stand in its payload."""
    if kind not in _layouts:
        hints = get_type_hints(kind, include_extras=True)
        _layouts[kind] = [(each.name, get_args(hints[each.name])[1]) for each in fields(cast(Any, kind))]
    return _layouts[kind]


class Request(Message, Generic[AnswerT]):
    """A message from the host. READS: it changes nothing, so that it may be sent again."""

    READS: ClassVar[bool] = False

    def __init_subclass__(cls, id: int | None = None, reads: bool = False) -> None:
        super().__init_subclass__(id)
        cls.READS = reads

    @classmethod
    def success(cls) -> type[AnswerT]:
        """The class of its success answer."""
        return cast(type[AnswerT], MESSAGES[cls.ID + 1])

    @classmethod
    def failure(cls) -> type[Message]:
        return MESSAGES[cls.ID + 2]


@dataclass(frozen=True)
class Failure(Message):
    """A failure answer with an error code (D-API-4)."""

    error: U8


def unpack(frame: Frame) -> Message:
    """The message in a frame. Raises FormatError when there is no such message, or its size is wrong."""
    try:
        kind = MESSAGES[frame.message]
    except KeyError:
        raise FormatError(f"there is no message {frame.message:04X}h") from None
    return kind.unpack(frame.payload)
