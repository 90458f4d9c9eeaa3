"""What can go wrong between host and arbitrator.

PdcpError
  ConnectionFailedError   the port cannot be opened, or is gone
  NoAnswerError           no answer in time
  BadAnswerError          an answer that is none
  RequestError            the arbitrator said no
    UnknownMessageError   2200h: it does not know this message
    ResetError            230Fh: these devices were not reset
"""

from collections.abc import Iterable

from .model import Identity
from .protocol import TEXTS, ErrorCode

__all__ = [
    "BadAnswerError",
    "ConnectionFailedError",
    "ErrorCode",
    "NoAnswerError",
    "PdcpError",
    "RequestError",
    "ResetError",
    "UnknownMessageError",
    "meaning",
]


def meaning(code: int) -> str:
    """What an error code says, in words; also of a code that nobody knows yet."""
    return TEXTS["error"].get(code, "unknown error")


class PdcpError(Exception):
    """Anything that this package raises of its own."""


class ConnectionFailedError(PdcpError):
    """The port cannot be opened, or it is gone."""


class NoAnswerError(PdcpError):
    """The arbitrator did not answer in time. What was asked for may have been done all the same."""


class BadAnswerError(PdcpError):
    """What arrived is no well-formed answer to the request."""


class RequestError(PdcpError):
    """A failure answer. code is an ErrorCode wherever the specification has one."""

    def __init__(self, message: int, code: int, what: str = "") -> None:
        self.message = message
        self.code = ErrorCode(code) if code in ErrorCode.__members__.values() else code
        self.meaning = what or f"{meaning(code)} (error {code:02X}h)"
        super().__init__(self.meaning)


class UnknownMessageError(RequestError):
    """The arbitrator does not know this message (2200h); code is 0."""

    def __init__(self, message: int) -> None:
        super().__init__(message, 0, f"the arbitrator does not know message {message:04X}h")


class ResetError(RequestError):
    """Not everything was reset. results are the eight bytes of 230Fh; devices are those that were not reset, empty
    where nobody knows."""

    def __init__(self, message: int, results: bytes, devices: Iterable[Identity] = ()) -> None:
        self.results = results
        self.devices = tuple(devices)
        names = ", ".join(str(each) for each in self.devices)
        super().__init__(message, 0, f"not reset: {names}" if names else "the reset failed or was refused")

    def was_reset(self, number: int) -> bool:
        """Of the device with this number, 1 to 64, when the request was made."""
        return bool(self.results[(number - 1) // 8] >> (number - 1) % 8 & 1)
