"""Frames from outside: logs, pcap and pcapng files of SocketCAN (link type 227), and buses by python-can."""

from __future__ import annotations

import io
import select
import socket
import struct
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, cast

import can

from .candump import read_log
from .frames import BASE_ID_MAX, EXTENDED_ID_MAX, Direction, Frame, FrameError

__all__ = ["Complain", "from_message", "open_bus", "open_frames", "play", "read_bus", "read_capture", "to_message"]

Complain = Callable[[str], None]

CONNECT_S = 3.0
LOOK = 512  # bytes of a file: a log has no 0 among them

_SOCKETCAN = 227
_EXTENDED_FLAG, _REMOTE_FLAG, _ERROR_FLAG = 0x80000000, 0x40000000, 0x20000000
_FD_BRS, _FD_ESI, _FD_FDF = 1, 2, 4
_HEADER_BYTES = 8
_FD_PACKET_BYTES = 72  # what SocketCAN hands out for a CAN FD frame, whatever its length
_PACKET_MAX = 1 << 20  # a larger block is no frame but a damaged file

_PCAP_MAGICS = {
    b"\xd4\xc3\xb2\xa1": ("<", 1_000_000),
    b"\xa1\xb2\xc3\xd4": (">", 1_000_000),
    b"\x4d\x3c\xb2\xa1": ("<", 1_000_000_000),
    b"\xa1\xb2\x3c\x4d": (">", 1_000_000_000),
}
_SECTION = b"\x0a\x0d\x0d\x0a"
_INTERFACE_BLOCK, _OLD_PACKET, _SIMPLE_PACKET, _PACKET = 1, 2, 3, 6
_OPTION_NAME, _OPTION_FLAGS, _OPTION_RESOLUTION, _OPTION_OFFSET = 2, 2, 9, 14


# --- one packet -----------------------------------------------------------------------------------


def _frame_of(packet: bytes, time_us: int, interface: str, direction: Direction) -> Frame:
    """A SocketCAN packet: identifier with flags (most significant byte first), length, FD flags, 2 bytes, data."""
    if len(packet) < _HEADER_BYTES:
        raise FrameError(f"a packet of {len(packet)} bytes, which is less than a SocketCAN header")
    word, length, flags, _, raw_dlc = struct.unpack_from(">IBBBB", packet)
    fd = bool(flags & _FD_FDF) or len(packet) == _FD_PACKET_BYTES
    remote = bool(word & _REMOTE_FLAG) and not fd
    data = b"" if remote else packet[_HEADER_BYTES : _HEADER_BYTES + length]
    if not remote and len(data) < length:
        raise FrameError(f"a packet with {len(data)} of its {length} bytes of data")
    error = bool(word & _ERROR_FLAG)
    extended = bool(word & _EXTENDED_FLAG) and not error
    return Frame(
        time_us,
        word & (EXTENDED_ID_MAX if extended or error else BASE_ID_MAX),
        data,
        extended=extended,
        remote=remote,
        error=error,
        fd=fd,
        bitrate_switch=fd and bool(flags & _FD_BRS),
        error_state=fd and bool(flags & _FD_ESI),
        dlc=length,
        raw_dlc=raw_dlc if not fd and length == 8 and 8 < raw_dlc < 16 else 0,
        interface=interface,
        direction=direction,
    )


class _File:
    """Reads a binary file piece by piece and knows where it is."""

    def __init__(self, stream: IO[bytes], name: str, complain: Complain) -> None:
        self.stream = stream
        self.name = name
        self.complain = complain
        self.at = 0

    def take(self, size: int) -> bytes | None:
        """So many bytes; None at the end of the file, which is told when it comes in the middle of a piece."""
        data = self.stream.read(size)
        if len(data) < size:
            if data:
                self.complain(f"{self.name}: byte {self.at}: the file ends in the middle of a packet")
            return None
        self.at += size
        return data

    def fail(self, message: str) -> None:
        self.complain(f"{self.name}: byte {self.at}: {message}")


# --- pcap -----------------------------------------------------------------------------------------


def _read_pcap(file: _File, magic: bytes) -> Iterator[Frame]:
    order, units = _PCAP_MAGICS[magic]
    head = file.take(20)
    if head is None:
        return
    link_type = struct.unpack_from(order + "I", head, 16)[0] & 0xFFFF
    if link_type != _SOCKETCAN:
        file.fail(f"link type {link_type}; only SocketCAN ({_SOCKETCAN}) holds CAN frames")
        return
    while (head := file.take(16)) is not None:
        seconds, fraction, size, _ = struct.unpack(order + "IIII", head)
        if size > _PACKET_MAX:
            file.fail(f"a packet of {size} bytes, the file is damaged")
            return
        packet = file.take(size)
        if packet is None:
            return
        try:
            yield _frame_of(packet, seconds * 1_000_000 + fraction * 1_000_000 // units, "can0", "")
        except FrameError as error:
            file.fail(str(error))


# --- pcapng ---------------------------------------------------------------------------------------


@dataclass(slots=True)
class _Interface:
    link_type: int
    name: str
    units: int = 1_000_000  # in a second
    offset_s: int = 0
    told: bool = False


@dataclass(slots=True)
class _Section:
    order: str
    interfaces: list[_Interface] = field(default_factory=list)


def _options(order: str, data: bytes) -> dict[int, bytes]:
    options: dict[int, bytes] = {}
    at = 0
    while at + 4 <= len(data):
        code, size = struct.unpack_from(order + "HH", data, at)
        if code == 0:
            break
        options.setdefault(code, data[at + 4 : at + 4 + size])
        at += 4 + (size + 3) // 4 * 4
    return options


def _interface_of(section: _Section, body: bytes) -> _Interface:
    link_type = struct.unpack_from(section.order + "H", body)[0]
    options = _options(section.order, body[8:])
    name = options.get(_OPTION_NAME, b"").decode("utf-8", "replace").split("\0")[0]
    interface = _Interface(link_type, "_".join(name.split()) or f"can{len(section.interfaces)}")
    resolution = options.get(_OPTION_RESOLUTION, b"\x06")[:1] or b"\x06"
    interface.units = 2 ** (resolution[0] & 0x7F) if resolution[0] & 0x80 else 10 ** resolution[0]
    offset = options.get(_OPTION_OFFSET, b"")
    if len(offset) == 8:
        interface.offset_s = struct.unpack(section.order + "q", offset)[0]
    return interface


def _packet_of(section: _Section, kind: int, body: bytes) -> tuple[int, int, bytes, Direction]:
    """Interface, time in units of the interface, packet, direction of a packet block."""
    if kind == _SIMPLE_PACKET:
        return 0, 0, body[4:], ""
    layout = "IIIII" if kind == _PACKET else "HHIIII"
    values = struct.unpack_from(section.order + layout, body)
    number, high, low, size = (values[0], *values[-4:-1])
    begin = struct.calcsize("=" + layout)
    flags = _options(section.order, body[begin + (size + 3) // 4 * 4 :]).get(_OPTION_FLAGS, b"")
    way = struct.unpack(section.order + "I", flags)[0] & 3 if len(flags) == 4 else 0
    direction: Direction = "R" if way == 1 else "T" if way == 2 else ""
    return number, high << 32 | low, body[begin : begin + size], direction


def _block_frame(file: _File, section: _Section, kind: int, body: bytes) -> Frame | None:
    number, time, packet, direction = _packet_of(section, kind, body)
    if number >= len(section.interfaces):
        raise FrameError(f"a packet of interface {number}, which is not described")
    interface = section.interfaces[number]
    if interface.link_type != _SOCKETCAN:
        if not interface.told:
            interface.told = True
            file.fail(f"interface {number} has link type {interface.link_type}; only SocketCAN ({_SOCKETCAN}) is read")
        return None
    time_us = interface.offset_s * 1_000_000 + time * 1_000_000 // interface.units
    return _frame_of(packet, time_us, interface.name, direction)


def _section_order(file: _File) -> tuple[str, bytes] | None:
    """Byte order of the section that begins here, and the first eight bytes behind its type."""
    head = file.take(8)
    if head is None:
        return None
    order = {b"\x1a\x2b\x3c\x4d": ">", b"\x4d\x3c\x2b\x1a": "<"}.get(head[4:])
    if order is None:
        file.fail("a section without byte order, the file is damaged")
        return None
    return order, head


def _read_body(file: _File, order: str, length_bytes: bytes, read: int) -> bytes | None:
    """The rest of a block of which `read` bytes were read, without its length at the end."""
    length = struct.unpack(order + "I", length_bytes)[0]
    if length % 4 or not 12 <= length <= _PACKET_MAX or length < read + 4:
        file.fail(f"a block of {length} bytes, the file is damaged")
        return None
    body = file.take(length - read)
    return None if body is None else body[:-4]


def _read_pcapng(file: _File, first: bytes) -> Iterator[Frame]:
    section = _Section("<")
    kind_bytes: bytes | None = first
    while kind_bytes is not None:
        if kind_bytes == _SECTION:
            start = _section_order(file)
            if start is None or _read_body(file, start[0], start[1][:4], 12) is None:
                return
            section = _Section(start[0])
        else:
            length = file.take(4)
            body = None if length is None else _read_body(file, section.order, length, 8)
            if body is None:
                return
            yield from _read_block(file, section, struct.unpack(section.order + "I", kind_bytes)[0], body)
        kind_bytes = file.take(4)


def _read_block(file: _File, section: _Section, kind: int, body: bytes) -> Iterator[Frame]:
    try:
        if kind == _INTERFACE_BLOCK:
            section.interfaces.append(_interface_of(section, body))
        elif kind in (_PACKET, _OLD_PACKET, _SIMPLE_PACKET):
            frame = _block_frame(file, section, kind, body)
            if frame is not None:
                yield frame
    except FrameError as error:
        file.fail(str(error))
    except struct.error:
        file.fail("a block that is too short for its kind")


def read_capture(stream: IO[bytes], name: str, complain: Complain) -> Iterator[Frame]:
    """The frames of a pcap or pcapng file. What is none is passed over and told to complain as `NAME: byte N: what`."""
    file = _File(stream, name, complain)
    magic = file.take(4)
    if magic == _SECTION:
        yield from _read_pcapng(file, magic)
    elif magic in _PCAP_MAGICS:
        yield from _read_pcap(file, magic)
    else:
        complain(f"{name}: neither pcap nor pcapng")


# --- files ----------------------------------------------------------------------------------------


@contextmanager
def open_frames(path: str, complain: Complain) -> Iterator[Iterator[Frame]]:
    """The frames of a file, `-` for standard input, whatever its format. Raises OSError."""
    if path == "-":
        stdin = sys.stdin.buffer
        stream = stdin if isinstance(stdin, io.BufferedReader) else io.BufferedReader(cast(io.RawIOBase, stdin))
        yield _read_any(stream, "standard input", complain)
        return
    with Path(path).open("rb") as file:
        yield _read_any(file, path, complain)


def _read_any(stream: io.BufferedReader, name: str, complain: Complain) -> Iterator[Frame]:
    start = stream.peek(4)[:4]
    if start == _SECTION or start in _PCAP_MAGICS:
        yield from read_capture(stream, name, complain)
    elif b"\0" in stream.peek(LOOK)[:LOOK]:
        complain(f"{name}: neither a log of candump -L nor pcap nor pcapng")
    else:
        lines = (line.decode("utf-8", "replace") for line in stream)
        yield from read_log(lines, name, complain)


# --- buses ----------------------------------------------------------------------------------------


def open_bus(interface: str, channel: str, options: dict[str, str]) -> can.BusABC:
    """A bus of python-can at 1 Mbit/s. For socketcand the channel may be HOST:PORT/NAME, as pdcpd prints it.

    Raises can.CanError, OSError or ValueError with what is wrong."""
    arguments: dict[str, object] = {"bitrate": 1_000_000, **options}
    if interface == "socketcand" and "/" in channel:
        address, _, channel = channel.partition("/")
        host, _, port = address.rpartition(":")
        arguments |= {"host": host, "port": port}
    if "port" in arguments:
        arguments["port"] = int(str(arguments["port"]))
    if interface == "socketcand" and "host" in arguments and "port" in arguments:
        # python-can would try for ten seconds and tell of each try.
        socket.create_connection((str(arguments["host"]), int(str(arguments["port"]))), CONNECT_S).close()
    return can.Bus(channel=channel, interface=interface, **arguments)  # type: ignore[arg-type]


def from_message(message: can.Message, interface: str) -> Frame:
    """A message of python-can as frame."""
    return Frame(
        round(message.timestamp * 1_000_000),
        message.arbitration_id & (EXTENDED_ID_MAX if message.is_extended_id or message.is_error_frame else BASE_ID_MAX),
        b"" if message.is_remote_frame else bytes(message.data),
        extended=message.is_extended_id and not message.is_error_frame,
        remote=message.is_remote_frame,
        error=message.is_error_frame,
        fd=message.is_fd,
        bitrate_switch=message.bitrate_switch,
        error_state=message.error_state_indicator,
        dlc=message.dlc,
        interface=interface,
        direction="R" if message.is_rx else "T",
    )


def is_sendable(bus: can.BusABC, interface: str, frame: Frame) -> bool:
    """Can this bus carry the frame as it is? python-can sends some that it cannot as other frames."""
    if frame.error:
        return False
    if frame.fd:
        return bus.protocol is not can.CanProtocol.CAN_20
    return not (frame.remote and interface == "socketcand")


def to_message(frame: Frame) -> can.Message:
    """A frame as python-can sends it."""
    return can.Message(
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        is_error_frame=frame.error,
        is_fd=frame.fd,
        bitrate_switch=frame.bitrate_switch,
        error_state_indicator=frame.error_state,
        dlc=frame.dlc,
        data=None if frame.remote else frame.data,
    )


def read_bus(
    bus: can.BusABC, interface: str, end_s: float | None, clock: Callable[[], float]
) -> Iterator[Frame | None]:
    """The frames of a bus as they come; None now and then while there are none. Ends at end_s of the clock. Raises
    can.CanError when the bus has gone."""
    while True:
        wait = 0.2 if end_s is None else min(0.2, end_s - clock())
        if wait <= 0:
            return
        message = bus.recv(wait)
        if message is None:
            _check_connection(bus)
        yield None if message is None else from_message(message, interface)


def _check_connection(bus: can.BusABC) -> None:
    """python-can's client of socketcand takes a connection that was closed for one without frames."""
    connection = getattr(bus, "_SocketCanDaemonBus__socket", None)
    if not isinstance(connection, socket.socket):
        return
    readable, _, _ = select.select([connection], [], [], 0)
    if readable and not connection.recv(1, socket.MSG_PEEK):
        raise can.CanOperationError("the connection was closed")


def play(
    frames: Iterable[Frame],
    send: Callable[[Frame], None],
    speed: float | None,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Sends frames in their order, each as long after the first as its time stamp says, divided by speed; None: at
    once.

    Waits are counted from the first frame, so that they do not add up errors. A frame that is earlier than the one
    before it is sent at once."""
    start_s, first_us = clock(), None
    for frame in frames:
        if first_us is None:
            first_us = frame.time_us
        if speed is not None:
            wait_s = start_s + (frame.time_us - first_us) / 1_000_000 / speed - clock()
            if wait_s > 0:
                sleep(wait_s)
        send(frame)
