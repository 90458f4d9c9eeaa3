"""How much of a bus its frames take: bits with stuffing and interframe space, by sender and by window of time."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

from .frames import Frame
from .stuffing import INTERFRAME_BITS, frame_bits

__all__ = ["BITRATE", "BusLoad", "Count", "Summary", "Window"]

BITRATE = 1_000_000


@dataclass(slots=True)
class Count:
    """Frames, and the bits that they took on the wire, interframe space included."""

    frames: int = 0
    bits: int = 0

    def add(self, bits: int) -> None:
        self.frames += 1
        self.bits += bits


@dataclass(slots=True)
class Window:
    """One stretch of time. A frame belongs to the window of its time stamp."""

    start_us: int
    total: Count = field(default_factory=Count)
    senders: defaultdict[str, Count] = field(default_factory=lambda: defaultdict(Count))


@dataclass(frozen=True, slots=True)
class Summary:
    """What one sender, or all together, took. Loads are shares of the bus, 0 to 1."""

    sender: str
    frames: int
    bits: int
    mean: float  # over all windows from the first frame to the last
    peak: float  # in the window that has most


class BusLoad:
    """Adds up frames. A CAN FD frame has no length at one bit rate: it is counted in `uncounted`, without bits."""

    def __init__(self, interval_us: int) -> None:
        self._interval_us = interval_us
        self._first_us = 0
        self._windows: dict[int, Window] = {}
        self.uncounted = 0

    def add(self, frame: Frame, sender: str) -> None:
        if frame.fd:
            self.uncounted += 1
            return
        if not self._windows:
            self._first_us = frame.time_us
        number = (frame.time_us - self._first_us) // self._interval_us
        window = self._windows.get(number)
        if window is None:
            window = self._windows[number] = Window(self._first_us + number * self._interval_us)
        bits = frame_bits(frame) + INTERFRAME_BITS
        window.total.add(bits)
        window.senders[sender].add(bits)

    def load(self, count: Count) -> float:
        """The share of the bus that this takes within one window."""
        return count.bits * 1_000_000 / (BITRATE * self._interval_us)

    def windows(self) -> list[Window]:
        """All windows in which there was something, earliest first."""
        return [window for _, window in sorted(self._windows.items())]

    def total(self) -> Summary:
        return self._summary("all", [window.total for window in self._windows.values()])

    def senders(self) -> list[Summary]:
        """Who sent most bits stands first."""
        counts: defaultdict[str, list[Count]] = defaultdict(list)
        for window in self._windows.values():
            for sender, count in window.senders.items():
                counts[sender].append(count)
        rows = [self._summary(sender, mine) for sender, mine in counts.items()]
        return sorted(rows, key=lambda row: (-row.bits, row.sender))

    def _summary(self, sender: str, counts: list[Count]) -> Summary:
        frames, bits = sum(count.frames for count in counts), sum(count.bits for count in counts)
        span = max(self._windows) - min(self._windows) + 1 if self._windows else 1
        mean = self.load(Count(frames, bits)) / span
        return Summary(sender, frames, bits, mean, max((self.load(count) for count in counts), default=0.0))
