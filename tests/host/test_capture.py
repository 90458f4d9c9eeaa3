"""pcap and pcapng files of SocketCAN, and python-can's messages. The files are put together here from their formats."""

import io
import socket
import struct
import threading
import time
from pathlib import Path

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdcp.candump import format_frame
from pdcp.capture import from_message, open_bus, open_frames, play, read_bus, read_capture, to_message
from pdcp.frames import Frame

SOCKETCAN = 227
EXTENDED, REMOTE, ERROR = 0x80000000, 0x40000000, 0x20000000


def packet(can_id: int, data: bytes, flags: int = 0, raw_dlc: int = 0, length: int = -1) -> bytes:
    """Link type 227: identifier and flags, most significant byte first, length, FD flags, 2 bytes, data."""
    return struct.pack(">IBBBB", can_id, len(data) if length < 0 else length, flags, 0, raw_dlc) + data


PACKETS = {
    packet(0x123, b"\x11\x22"): "123#1122",
    packet(0x7FF, b""): "7FF#",
    packet(0x12345678 | EXTENDED, b"\x01"): "12345678#01",
    packet(0x123 | EXTENDED, b""): "00000123#",
    packet(0x123 | REMOTE, b"", length=4): "123#R4",
    packet(4 | ERROR, bytes(8)): "20000004#0000000000000000",
    packet(0x123, bytes(8), raw_dlc=10): "123#0000000000000000_A",
    packet(0x123, b"\x01\x02", flags=4): "123##00102",
    packet(0x123, b"\x01\x02", flags=7): "123##30102",
    packet(0x123, b"\x01" + bytes(7), flags=0)[:16]: "123#0100000000000000",
    packet(0x123, b"\x01\x02\x03" + bytes(61), length=3): "123##0010203",  # as long as SocketCAN hands out CAN FD
}


def pcap(
    *packets: bytes, order: str = "<", magic: int = 0xA1B2C3D4, link_type: int = SOCKETCAN, units: int = 1000
) -> bytes:
    data = struct.pack(order + "IHHiIII", magic, 2, 4, 0, 0, 262144, link_type)
    for number, each in enumerate(packets):
        data += struct.pack(order + "IIII", 100, number * units, len(each), len(each)) + each
    return data


def block(kind: int, body: bytes, order: str = "<") -> bytes:
    body += bytes(-len(body) % 4)
    return struct.pack(order + "II", kind, len(body) + 12) + body + struct.pack(order + "I", len(body) + 12)


def option(code: int, value: bytes, order: str = "<") -> bytes:
    return struct.pack(order + "HH", code, len(value)) + value + bytes(-len(value) % 4)


def section(order: str = "<") -> bytes:
    return block(0x0A0D0D0A, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1), order)


def interface(link_type: int = SOCKETCAN, options: bytes = b"", order: str = "<") -> bytes:
    return block(1, struct.pack(order + "HHI", link_type, 0, 0) + options, order)


def enhanced(data: bytes, time: int = 0, number: int = 0, options: bytes = b"", order: str = "<") -> bytes:
    head = struct.pack(order + "IIIII", number, time >> 32, time & 0xFFFFFFFF, len(data), len(data))
    return block(6, head + data + bytes(-len(data) % 4) + options, order)


def read(data: bytes) -> tuple[list[str], list[str]]:
    """The lines of a log with the frames, and the complaints."""
    complaints: list[str] = []
    frames = list(read_capture(io.BytesIO(data), "a.pcap", complaints.append))
    return [format_frame(frame) for frame in frames], complaints


@pytest.mark.parametrize("data", PACKETS, ids=lambda data: PACKETS[data])
def test_every_kind_of_packet(data: bytes) -> None:
    assert read(pcap(data)) == ([f"(100.000000) can0 {PACKETS[data]}"], [])
    assert read(section() + interface() + enhanced(data)) == ([f"(0.000000) can0 {PACKETS[data]}"], [])


@pytest.mark.parametrize("order", ["<", ">"])
def test_pcap_in_both_byte_orders_and_resolutions(order: str) -> None:
    two = (packet(1, b""), packet(2, b""))
    expected = ["(100.000000) can0 001#", "(100.001000) can0 002#"]
    assert read(pcap(*two, order=order)) == (expected, [])
    assert read(pcap(*two, order=order, magic=0xA1B23C4D, units=1_000_000)) == (expected, [])


@pytest.mark.parametrize("order", ["<", ">"])
def test_pcapng_in_both_byte_orders(order: str) -> None:
    data = section(order) + interface(order=order) + enhanced(packet(1, b""), 1_500_000, order=order)
    assert read(data) == (["(1.500000) can0 001#"], [])


def test_pcapng_options() -> None:
    named = option(2, b"vcan7") + option(9, b"\x09") + option(14, struct.pack("<q", 10)) + option(0, b"")
    binary = option(9, b"\x8a")  # 2^-10 s
    data = section() + interface(options=named) + interface(options=binary)
    data += enhanced(packet(1, b"\x01"), 1_500_000_000, 0, option(2, struct.pack("<I", 1)))
    data += enhanced(packet(2, b"\x01"), 512, 1, option(1, b"a comment") + option(2, struct.pack("<I", 2)))
    assert read(data) == (["(11.500000) vcan7 001#01 R", "(0.500000) can1 002#01 T"], [])


def test_other_blocks_are_passed_over() -> None:
    simple = block(3, struct.pack("<I", 9) + packet(3, b"\x03"))
    old = block(2, struct.pack("<HHIIII", 0, 0, 0, 250_000, 9, 9) + packet(4, b"\x04"))
    data = section() + block(4, bytes(8)) + interface() + block(0xBAD, b"x") + simple + old
    assert read(data) == (["(0.000000) can0 003#03", "(0.250000) can0 004#04"], [])


def test_a_second_section_has_its_own_interfaces_and_byte_order() -> None:
    data = section() + interface() + enhanced(packet(1, b"")) + section(">") + interface(order=">")
    data += enhanced(packet(2, b""), order=">")
    assert read(data) == (["(0.000000) can0 001#", "(0.000000) can0 002#"], [])


def test_other_link_types_are_told_once() -> None:
    data = section() + interface(1) + interface() + enhanced(b"ethernet", 0, 0) * 2 + enhanced(packet(1, b""), 0, 1)
    frames, complaints = read(data)
    assert frames == ["(0.000000) can1 001#"]
    assert complaints == ["a.pcap: byte 108: interface 0 has link type 1; only SocketCAN (227) is read"]
    assert read(pcap(link_type=1)) == ([], ["a.pcap: byte 24: link type 1; only SocketCAN (227) holds CAN frames"])


DAMAGED = {
    b"": "a.pcap: neither pcap nor pcapng",
    b"abcdefgh": "a.pcap: neither pcap nor pcapng",
    pcap()[:20]: "a.pcap: byte 4: the file ends in the middle of a packet",
    pcap(packet(1, b"\x01"))[:-1]: "a.pcap: byte 40: the file ends in the middle of a packet",
    pcap(b"short"): "a.pcap: byte 45: a packet of 5 bytes, which is less than a SocketCAN header",
    pcap(packet(1, b"\x01", length=2)): "a.pcap: byte 49: a packet with 1 of its 2 bytes of data",
    pcap(packet(1, bytes(9))): "a.pcap: byte 57: 9 bytes are more than a frame holds",
    pcap()
    + struct.pack("<IIII", 0, 0, 1 << 30, 0): "a.pcap: byte 40: a packet of 1073741824 bytes, the file is damaged",
    section()[:10]: "a.pcap: byte 4: the file ends in the middle of a packet",
    section()[:8] + bytes(20): "a.pcap: byte 12: a section without byte order, the file is damaged",
    section() + struct.pack("<II", 1, 13): "a.pcap: byte 36: a block of 13 bytes, the file is damaged",
    section() + enhanced(packet(1, b"")): "a.pcap: byte 68: a packet of interface 0, which is not described",
    section() + interface() + block(6, b"1234"): "a.pcap: byte 64: a block that is too short for its kind",
}


@pytest.mark.parametrize("data", DAMAGED, ids=lambda data: DAMAGED[data])
def test_damage_is_told_with_its_place(data: bytes) -> None:
    frames, complaints = read(data)
    assert (frames, complaints) == ([], [DAMAGED[data]])


def test_frames_before_and_behind_a_bad_packet_are_kept() -> None:
    frames, complaints = read(pcap(packet(1, b""), b"bad", packet(2, b"")))
    assert frames == ["(100.000000) can0 001#", "(100.002000) can0 002#"]
    assert len(complaints) == 1


STARTS = (b"", section(), section() + interface(), pcap(), section(">") + interface(order=">"))


@given(
    st.sampled_from(STARTS), st.one_of(st.binary(max_size=200), st.binary(max_size=60).map(lambda body: block(6, body)))
)
def test_any_file_is_read_or_told(start: bytes, data: bytes) -> None:
    read(start + data)


def test_formats_are_told_apart(tmp_path: Path) -> None:
    files = {
        "a.log": b"(1.000000) can0 001#\n",
        "a.pcap": pcap(packet(1, b"")),
        "a.pcapng": section() + interface() + enhanced(packet(1, b"")),
    }
    for name, data in files.items():
        path = tmp_path / name
        path.write_bytes(data)
        with open_frames(str(path), pytest.fail) as frames:
            assert [frame.can_id for frame in frames] == [1]


MESSAGES = st.builds(
    Frame, st.integers(0, 2**40), st.integers(0, 0x7FF), st.binary(max_size=8), direction=st.sampled_from(("R", "T"))
)


@given(MESSAGES)
def test_frames_go_through_python_can(frame: Frame) -> None:
    message = to_message(frame)
    message.timestamp = frame.time_us / 1_000_000
    message.is_rx = frame.direction == "R"
    assert from_message(message, "can0") == frame


def test_other_kinds_go_through_python_can() -> None:
    for frame in (
        Frame(0, 0x12345678, b"\x01", extended=True, direction="R"),
        Frame(0, 0x123, remote=True, dlc=5, direction="R"),
        Frame(0, 0x123, bytes(12), fd=True, bitrate_switch=True, direction="R"),
    ):
        assert from_message(to_message(frame), "can0") == frame


def test_a_bus_of_python_can() -> None:
    with open_bus("virtual", "pdcp-test", {}) as ours, can.Bus("pdcp-test", interface="virtual") as other:
        other.send(can.Message(arbitration_id=0x100, data=b"\x0a", is_extended_id=False))
        clock = iter((0.0, 0.0, 1.0)).__next__
        frames = [frame for frame in read_bus(ours, "can0", 0.5, clock) if frame is not None]
        assert [(frame.can_id, frame.data, frame.interface) for frame in frames] == [(0x100, b"\x0a", "can0")]


def test_socketcand_takes_host_port_and_name(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, object] = {}
    monkeypatch.setattr(can, "Bus", lambda **arguments: asked.update(arguments))
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        open_bus("socketcand", f"127.0.0.1:{port}/limb", {})
    with pytest.raises(ConnectionRefusedError):
        open_bus("socketcand", f"127.0.0.1:{port}/limb", {})
    assert asked == {
        "interface": "socketcand", "channel": "limb", "host": "127.0.0.1", "port": port, "bitrate": 1_000_000,
    }  # fmt: skip


def test_a_socketcand_server_that_ends_is_noticed() -> None:
    """On the wire as architecture.md 3 has it: hi, open, ok, rawmode, ok, frames."""

    opened = threading.Event()

    def serve(server: socket.socket) -> None:
        server.accept()[0].close()  # open_bus looks whether somebody is there
        connection, _ = server.accept()
        with connection:
            connection.sendall(b"< hi >")
            connection.recv(100)
            connection.sendall(b"< ok >")
            connection.recv(100)
            connection.sendall(b"< ok >")
            opened.wait(10)  # python-can takes what comes with the last ok for a part of it (D-SIM-2)
            connection.sendall(b"< frame 100 1.500000 0A >")

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=serve, args=(server,))
        thread.start()
        with open_bus("socketcand", f"127.0.0.1:{server.getsockname()[1]}/limb", {}) as bus:
            opened.set()
            frames = []
            with pytest.raises(can.CanOperationError, match="the connection was closed"):
                for frame in read_bus(bus, "limb", None, time.monotonic):
                    frames += [frame] if frame else []
        thread.join()
    assert [(frame.time_us, frame.can_id, frame.data) for frame in frames] == [(1_500_000, 0x100, b"\x0a")]


class Clock:
    """Virtual time: sleeping is what passes it."""

    def __init__(self) -> None:
        self.now_s = 50.0
        self.sent: list[tuple[float, int]] = []

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds

    def send(self, frame: Frame) -> None:
        self.sent.append((round(self.now_s - 50, 6), frame.can_id))
        self.now_s += 0.001  # what it takes

    def play(self, speed: float | None, *times_us: int) -> list[tuple[float, int]]:
        frames = [Frame(time_us, number) for number, time_us in enumerate(times_us)]
        play(frames, self.send, speed, lambda: self.now_s, self.sleep)
        return self.sent


def test_play_keeps_the_times_without_adding_up_errors() -> None:
    assert Clock().play(1.0, 7_000_000, 7_100_000, 7_200_000) == [(0, 0), (0.1, 1), (0.2, 2)]
    assert Clock().play(2.0, 7_000_000, 7_100_000, 7_200_000) == [(0, 0), (0.05, 1), (0.1, 2)]


def test_play_does_not_wait_for_what_is_late_or_if_told() -> None:
    assert Clock().play(1.0, 5_000_000, 5_000_000, 4_000_000, 5_010_000) == [(0, 0), (0.001, 1), (0.002, 2), (0.01, 3)]
    assert Clock().play(None, 0, 9_000_000) == [(0, 0), (0.001, 1)]
