"""The line to the arbitrator."""

import errno
import fcntl
import os
import time
from pathlib import Path
from typing import Protocol

import serial

from .errors import ConnectionFailedError

BAUD = 128_000  # or 57600; a pseudo-terminal takes any
READ_MAX = 4096  # bytes in one go
SLICE_S = 0.05  # a wait is cut into pieces, so that another thread can end it


class Transport(Protocol):
    """A stream of bytes in both directions. Every method raises ConnectionFailedError when it is gone."""

    def read(self, timeout_s: float) -> bytes:
        """Waits until there is at least one byte, and returns what there is; empty when the time has passed."""
        ...

    def write(self, data: bytes) -> None: ...

    def close(self) -> None: ...


def _reason(port: str, error: Exception) -> str:
    number = error.errno if isinstance(error, OSError) else None
    if number in (errno.EAGAIN, errno.EWOULDBLOCK):
        return "another program has it open"
    if number is None and len(error.args) == 2 and isinstance(error.args[0], int):
        number = error.args[0]  # termios.error
    if number in (errno.ENOTTY, errno.EINVAL) or "(25," in str(error):
        return "it is no serial port"
    return os.strerror(number) if number is not None else str(error).replace(f"{port}: ", "")


def _is_left_over(port: str) -> bool:
    """Is this the link of a daemon that has ended without removing it? It may lead to another daemon by now, or into
    somebody's terminal: its owner has PORT.lock locked, as long as it runs (D-LIN-4)."""
    lock = Path(f"{port}.lock")
    if not Path(port).is_symlink() or not lock.is_file():
        return False
    try:
        with lock.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            return True
    except OSError:  # somebody holds it, or it is not for this user to know
        return False


class SerialTransport:
    """A serial port or pseudo-terminal, for this program alone; or anything else that pyserial has a URL for."""

    def __init__(self, port: str, baud: int = BAUD) -> None:
        self.port = port
        if _is_left_over(port):
            raise ConnectionFailedError(f"cannot open {port}: its daemon has ended without removing this link")
        try:
            # Fixed time-out: pyserial sets the whole port up again for a new one, baud rate included. Opening also
            # drops what was sent to a host before this one.
            self._serial = serial.serial_for_url(port, baudrate=baud, timeout=SLICE_S, exclusive=True)
        except (OSError, ValueError) as error:  # serial.SerialException is an OSError
            raise ConnectionFailedError(f"cannot open {port}: {_reason(port, error)}") from error

    def read(self, timeout_s: float) -> bytes:
        return self.read_at_most(READ_MAX, timeout_s)

    def read_at_most(self, count: int, timeout_s: float) -> bytes:
        """Like read, and leaves the bytes beyond count for later."""
        deadline_s = time.monotonic() + timeout_s
        try:
            while True:
                data: bytes = self._serial.read(min(count, max(1, self._serial.in_waiting)))
                if data or time.monotonic() >= deadline_s:
                    return data
        except (OSError, TypeError) as error:  # TypeError: pyserial's, when another thread has closed it
            raise ConnectionFailedError(f"{self.port} is gone") from error

    def write(self, data: bytes) -> None:
        try:
            self._serial.write(data)
        except OSError as error:
            raise ConnectionFailedError(f"{self.port} is gone") from error

    def close(self) -> None:
        self._serial.close()
