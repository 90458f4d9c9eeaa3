"""What a limb and its arbitrator consist of, as the host sees them. Plain values: nothing here talks to anybody."""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, Self

from .protocol import Action, Flags, LinkStatus, ProfileState

__all__ = [
    "BROADCAST",
    "UINT8_MAX",
    "UINT16_MAX",
    "Action",
    "ArbitratorInfo",
    "Channel",
    "ChannelId",
    "Counter",
    "Device",
    "Direction",
    "Flags",
    "Identity",
    "Limits",
    "Link",
    "LinkStatus",
    "ProfileState",
    "Stats",
    "SystemInfo",
    "parse_number",
]

UINT16_MAX = 0xFFFF
UINT8_MAX = 0xFF


def parse_number(text: str) -> int:
    """A number as people write it: decimal, or hexadecimal with 0x; leading zeros mean nothing."""
    try:
        return int(text, 16) if text[:2].lower() == "0x" else int(text, 10)
    except ValueError:
        raise ValueError(f"'{text}' is no number (decimal, or hexadecimal with 0x)") from None


@dataclass(frozen=True, order=True, slots=True)
class Identity:
    """Vendor, product and serial number of a device, 16 bits each. Written as VID:PID:SN, in decimal."""

    vid: int
    pid: int
    sn: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Reads VID:PID:SN, each decimal or hexadecimal with 0x. Raises ValueError."""
        words = text.split(":")
        if len(words) != 3:
            raise ValueError(f"'{text}' is no VID:PID:SN")
        numbers = [parse_number(word) for word in words]
        for number in numbers:
            if not 0 <= number <= UINT16_MAX:
                raise ValueError(f"{number} in '{text}' is not between 0 and {UINT16_MAX}")
        return cls(*numbers)

    def __str__(self) -> str:
        return f"{self.vid}:{self.pid}:{self.sn}"


BROADCAST = Identity(0, 0, 0)


@dataclass(frozen=True, order=True, slots=True)
class ChannelId:
    """A channel by its device and its index there; index 0 is the device itself. Written as VID:PID:SN.INDEX."""

    identity: Identity
    index: int = 0

    @classmethod
    def parse(cls, text: str) -> Self:
        """Reads VID:PID:SN.INDEX, or VID:PID:SN for the device itself. Raises ValueError."""
        device, dot, index_text = text.partition(".")
        index = parse_number(index_text) if dot else 0
        if not 0 <= index <= UINT8_MAX:
            raise ValueError(f"index {index} in '{text}' is not between 0 and {UINT8_MAX}")
        return cls(Identity.parse(device), index)

    def __str__(self) -> str:
        return f"{self.identity}.{self.index}" if self.index else str(self.identity)


class Direction(StrEnum):
    """Of a channel, seen from its device."""

    INPUT = "input"
    OUTPUT = "output"


class SystemInfo(NamedTuple):
    """How many there are (2202h). Links count whether they are active or not."""

    devices: int
    inputs: int
    outputs: int
    links: int


@dataclass(frozen=True, slots=True)
class Device:
    """A bound device; number is its place in the list and changes when others come and go."""

    number: int
    identity: Identity
    type: int
    profile: int

    @property
    def id(self) -> ChannelId:
        return ChannelId(self.identity)


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel of a device; number is its place in the list of inputs or outputs."""

    number: int
    direction: Direction
    id: ChannelId
    type: int
    profile: int


@dataclass(frozen=True, slots=True)
class Link:
    """An output that feeds an input."""

    number: int
    output: ChannelId
    input: ChannelId
    status: LinkStatus


@dataclass(frozen=True, slots=True)
class Limits:
    """Sizes of the arbitrator's tables."""

    devices: int
    channels: int
    links: int


@dataclass(frozen=True, slots=True)
class ArbitratorInfo:
    """What the arbitrator says of itself (2402h). active is the active configuration, 0 for none."""

    protocol: int
    firmware: tuple[int, int, int]
    limits: Limits
    profile_state: ProfileState
    active: int
    stored: int
    flags: Flags

    @property
    def firmware_text(self) -> str:
        return ".".join(str(part) for part in self.firmware)


@dataclass(frozen=True, slots=True)
class Counter:
    """A counter of the arbitrator. Those that this package has no name for are called counter_N."""

    name: str
    value: int
    text: str


@dataclass(frozen=True, slots=True)
class Stats:
    """A group of counters (2414h), in the arbitrator's order."""

    group: int
    name: str
    counters: tuple[Counter, ...]

    def __getitem__(self, name: str) -> int:
        for counter in self.counters:
            if counter.name == name:
                return counter.value
        raise KeyError(name)
