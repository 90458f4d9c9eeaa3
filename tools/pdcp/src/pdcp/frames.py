"""A CAN frame as all tools here have it: read from a log, a capture or a bus, decoded, counted, played back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["BASE_ID_MAX", "DATA_MAX", "EXTENDED_ID_MAX", "Direction", "Frame", "FrameError"]

BASE_ID_MAX = 0x7FF
EXTENDED_ID_MAX = 0x1FFFFFFF
DATA_MAX = 8
FD_SIZES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)

Direction = Literal["", "R", "T"]


class FrameError(ValueError):
    """Something that is no frame. The message says what is wrong; who reads a file adds where."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame. `can_id` has 11 bits, 29 with `extended`; an error frame has its class bits there (SocketCAN's).

    `dlc` is the number of bytes that a remote frame asks for; of other frames it is the number of data bytes.
    `raw_dlc` is 9 to 15 when a frame of 8 bytes had such a code on the wire, else 0."""

    time_us: int
    can_id: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False
    error: bool = False
    fd: bool = False
    bitrate_switch: bool = False  # fd
    error_state: bool = False  # fd: the sender is error passive
    dlc: int = -1
    raw_dlc: int = 0
    interface: str = "can0"
    direction: Direction = ""  # R received, T transmitted, as candump -x has it

    def __post_init__(self) -> None:
        if self.dlc < 0:
            object.__setattr__(self, "dlc", len(self.data))
        if not 0 <= self.can_id <= (EXTENDED_ID_MAX if self.extended or self.error else BASE_ID_MAX):
            raise FrameError(f"identifier {self.can_id:X}h is too large for {29 if self.extended else 11} bits")
        self._check_size()

    def _check_size(self) -> None:
        if self.fd and len(self.data) not in FD_SIZES:
            raise FrameError(f"a CAN FD frame cannot hold {len(self.data)} bytes")
        if not self.fd and not 0 <= self.dlc <= DATA_MAX:
            raise FrameError(f"{self.dlc} bytes are more than a frame holds")
        if self.dlc != len(self.data) and not (self.remote and not self.data):
            raise FrameError(f"{len(self.data)} bytes of data with DLC {self.dlc}")

    @property
    def is_base(self) -> bool:
        """A base data frame, the only kind that PDCP uses."""
        return not (self.extended or self.remote or self.error or self.fd)

    @property
    def kind(self) -> str:
        """`base`, `extended`, `remote`, `error` or `fd`, as the arbitrator counts what it ignores."""
        if self.error:
            return "error"
        if self.fd:
            return "fd"
        if self.remote:
            return "remote"
        return "extended" if self.extended else "base"
