"""Logs of `candump -L`: `(1.000000) can0 123#11AA R`, one frame a line.

The reader takes what can-utils write and accept: an `R` or `T` behind the frame (`-x`), remote frames (`#R`,
`#R4`), identifiers of 3 and of 8 digits, CAN FD (`##`), error frames, raw lengths (`_9`), dots between bytes,
fractions of any length; empty lines and comments (`#` at the start) are skipped. The writer writes what candump
writes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator

from .frames import EXTENDED_ID_MAX, Direction, Frame, FrameError

__all__ = ["format_frame", "parse_line", "read_log"]

_ERROR_FLAG = 0x20000000
_FD_BRS, _FD_ESI = 1, 2
_BASE_DIGITS, _EXTENDED_DIGITS = 3, 8

_SECONDS_DIGITS = 11  # 3,000 years
_QUOTED = 40  # characters of what is wrong

_LINE = re.compile(r"\(([0-9]+)(?:\.([0-9]*))?\)\s+(\S+)\s+([^\s#]*)#(\S*)(?:\s+(\S+))?")
_DATA = re.compile(r"((?:[0-9A-Fa-f]{2}\.?)*)(?:_([9A-Fa-f]))?")
_REMOTE = re.compile(r"[Rr]([0-8])?(?:_([9A-Fa-f]))?")


def _quoted(text: str) -> str:
    return repr(text if len(text) <= _QUOTED else text[:_QUOTED] + "...")


def _time_us(seconds: str, fraction: str | None) -> int:
    if len(seconds) > _SECONDS_DIGITS:
        raise FrameError(f"a time of more than {_SECONDS_DIGITS} digits before the point")
    return int(seconds) * 1_000_000 + int((fraction or "")[:6].ljust(6, "0"))


def _identifier(text: str) -> tuple[int, bool, bool]:
    """Identifier, extended, error."""
    if not re.fullmatch(r"[0-9A-Fa-f]+", text) or len(text) not in (_BASE_DIGITS, _EXTENDED_DIGITS):
        raise FrameError(f"identifier {_quoted(text)} must have 3 or 8 hexadecimal digits")
    value = int(text, 16)
    if len(text) == _EXTENDED_DIGITS and value & _ERROR_FLAG:
        return value & EXTENDED_ID_MAX, False, True
    return value, len(text) == _EXTENDED_DIGITS, False


def _bytes(text: str) -> tuple[bytes, int]:
    """Data and raw length code."""
    match = _DATA.fullmatch(text)
    if match is None:
        raise FrameError(f"data {_quoted(text)} must be pairs of hexadecimal digits")
    return bytes.fromhex(match[1].replace(".", "")), int(match[2] or "0", 16)


def _direction(text: str | None) -> Direction:
    match text:
        case None:
            return ""
        case "R":
            return "R"
        case "T":
            return "T"
    raise FrameError(f"{_quoted(text)} behind the frame, where only R or T may stand")


def parse_line(line: str) -> Frame:
    """The frame of one line. Raises FrameError."""
    match = _LINE.fullmatch(line.strip())
    if match is None:
        raise FrameError("not a line of candump -L, such as (1.000000) can0 123#11AA")
    seconds, fraction, interface, id_text, body, tail = match.groups()
    time_us = _time_us(seconds, fraction)
    can_id, extended, error = _identifier(id_text)
    direction = _direction(tail)
    if body.startswith("##"):
        raise FrameError("CAN XL frames are not supported")
    if body.startswith("#"):
        if not re.match(r"#[0-9A-Fa-f]", body):
            raise FrameError("a CAN FD frame must have a digit of flags behind ##")
        flags = int(body[1], 16)
        data, _ = _bytes(body[2:])
        return Frame(
            time_us, can_id, data, extended=extended, fd=True, bitrate_switch=bool(flags & _FD_BRS),
            error_state=bool(flags & _FD_ESI), interface=interface, direction=direction,
        )  # fmt: skip
    remote = _REMOTE.fullmatch(body)
    if remote:
        return Frame(
            time_us, can_id, extended=extended, remote=True, dlc=int(remote[1] or 0),
            raw_dlc=int(remote[2] or "0", 16), interface=interface, direction=direction,
        )  # fmt: skip
    data, raw_dlc = _bytes(body)
    return Frame(
        time_us, can_id, data, extended=extended, error=error, raw_dlc=raw_dlc, interface=interface, direction=direction
    )


def format_frame(frame: Frame) -> str:
    """The line of a frame, without its end: six digits of fraction, capitals, the direction if it is known."""
    can_id = f"{frame.can_id:03X}"
    if frame.extended or frame.error:
        can_id = f"{frame.can_id | (_ERROR_FLAG if frame.error else 0):08X}"
    raw = f"_{frame.raw_dlc:X}" if frame.raw_dlc else ""
    if frame.fd:
        flags = (_FD_BRS if frame.bitrate_switch else 0) | (_FD_ESI if frame.error_state else 0)
        body = f"#{flags:X}{frame.data.hex().upper()}"
    elif frame.remote:
        body = f"R{frame.dlc or ''}{raw}"
    else:
        body = frame.data.hex().upper() + raw
    seconds, fraction = divmod(frame.time_us, 1_000_000)
    tail = f" {frame.direction}" if frame.direction else ""
    return f"({seconds}.{fraction:06d}) {frame.interface} {can_id}#{body}{tail}"


def read_log(lines: Iterable[str], name: str, complain: Callable[[str], None]) -> Iterator[Frame]:
    """The frames of a log. A line that is none is passed over and told to complain as `NAME:LINE: what`."""
    for number, line in enumerate(lines, start=1):
        text = line.removeprefix("\ufeff").strip() if number == 1 else line.strip()
        if not text or text.startswith("#"):
            continue
        try:
            yield parse_line(text)
        except FrameError as error:
            complain(f"{name}:{number}: {error}")
