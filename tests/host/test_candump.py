"""Logs of candump -L: what can-utils write is read, what is written is what they write."""

import io

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdcp.candump import format_frame, parse_line, read_log
from pdcp.frames import BASE_ID_MAX, EXTENDED_ID_MAX, FD_SIZES, Frame, FrameError

GOOD = {
    "(1.000000) can0 123#11AA": Frame(1_000_000, 0x123, b"\x11\xaa"),
    "(1.000000) can0 123#11AA R": Frame(1_000_000, 0x123, b"\x11\xaa", direction="R"),
    "(1.000000) can0 123#11AA T": Frame(1_000_000, 0x123, b"\x11\xaa", direction="T"),
    "(1436509052.249713) vcan0 044#2A366C2BBA": Frame(
        1436509052249713, 0x044, bytes.fromhex("2A366C2BBA"), interface="vcan0"
    ),
    "(0.000001) can0 7FF#": Frame(1, 0x7FF),
    "(0.000000) can0 12345678#0102030405060708": Frame(0, 0x12345678, bytes(range(1, 9)), extended=True),
    "(0.000000) can0 00000123#": Frame(0, 0x123, extended=True),
    "(0.000000) can0 123#R": Frame(0, 0x123, remote=True),
    "(0.000000) can0 123#R8": Frame(0, 0x123, remote=True, dlc=8),
    "(0.000000) can0 123#R8_E": Frame(0, 0x123, remote=True, dlc=8, raw_dlc=14),
    "(0.000000) can0 00000123#R4 T": Frame(0, 0x123, remote=True, extended=True, dlc=4, direction="T"),
    "(0.000000) can0 123#1122334455667788_9": Frame(0, 0x123, bytes.fromhex("1122334455667788"), raw_dlc=9),
    "(0.000000) can0 123##0112233": Frame(0, 0x123, b"\x11\x22\x33", fd=True),
    "(0.000000) can0 12345678##3": Frame(0, 0x12345678, extended=True, fd=True, bitrate_switch=True, error_state=True),
    "(0.000000) can0 20000004#0004000000000000": Frame(0, 4, bytes.fromhex("0004000000000000"), error=True),
}

# Read all the same, written in the form above.
TOLERATED = {
    "(1.5) can0 123#11": "(1.500000) can0 123#11",
    "(1.) can0 123#11": "(1.000000) can0 123#11",
    "(1) can0 123#11": "(1.000000) can0 123#11",
    "(1.123456789) can0 123#11": "(1.123456) can0 123#11",  # candump -N: nanoseconds
    "  (1.000000)\tcan0   123#11  R  \r\n": "(1.000000) can0 123#11 R",
    "(1.000000) can0 7ff#aa.bb.cc": "(1.000000) can0 7FF#AABBCC",
    "(1.000000) can0 123#r": "(1.000000) can0 123#R",
    "(1.000000) can0 123#R0": "(1.000000) can0 123#R",
}

BAD = {
    "": "not a line of candump -L",
    "can0 123#11": "not a line of candump -L",
    "(1.000000) can0 123": "not a line of candump -L",
    "(1.000000) can0  123   [2]  11 22": "not a line of candump -L",
    "(-1.000000) can0 123#11": "not a line of candump -L",
    "(1.000000) can0 123#11 R x": "not a line of candump -L",
    "(1.000000) can0 12#11": "identifier '12' must have 3 or 8 hexadecimal digits",
    "(1.000000) can0 #11": "identifier '' must have 3 or 8 hexadecimal digits",
    "(1.000000) can0 1G3#11": "identifier '1G3' must have 3 or 8 hexadecimal digits",
    "(1.000000) can0 800#11": "identifier 800h is too large for 11 bits",
    "(1.000000) can0 80000000#11": "identifier 80000000h is too large for 29 bits",
    "(1.000000) can0 123#1": "data '1' must be pairs of hexadecimal digits",
    "(1.000000) can0 123#1x": "data '1x' must be pairs of hexadecimal digits",
    "(1.000000) can0 123#112233445566778899": "9 bytes are more than a frame holds",
    "(1.000000) can0 123#R9": "data 'R9' must be pairs of hexadecimal digits",
    "(1.000000) can0 123#11 X": "'X' behind the frame, where only R or T may stand",
    "(1.000000) can0 123##": "a CAN FD frame must have a digit of flags behind ##",
    "(1.000000) can0 123##0" + "00" * 9: "a CAN FD frame cannot hold 9 bytes",
    "(1.000000) can0 123###": "CAN XL frames are not supported",
}


@pytest.mark.parametrize("line", GOOD)
def test_lines_of_can_utils(line: str) -> None:
    assert parse_line(line) == GOOD[line]
    assert format_frame(GOOD[line]) == line


@pytest.mark.parametrize("line", TOLERATED)
def test_other_ways_to_write_it(line: str) -> None:
    assert format_frame(parse_line(line)) == TOLERATED[line]


@pytest.mark.parametrize("line", BAD)
def test_what_is_no_line(line: str) -> None:
    with pytest.raises(FrameError) as caught:
        parse_line(line)
    assert str(caught.value).startswith(BAD[line])


def test_bad_lines_are_told_with_file_and_line_and_lose_nothing() -> None:
    complaints: list[str] = []
    lines = ["# a comment\n", "\n", "(1.0) can0 123#11\n", "nonsense\n", "(2.0) can0 12#11\n", "(3.0) can0 123#22\n"]
    frames = list(read_log(lines, "a.log", complaints.append))
    assert [frame.time_us for frame in frames] == [1_000_000, 3_000_000]
    assert complaints == [
        "a.log:4: not a line of candump -L, such as (1.000000) can0 123#11AA",
        "a.log:5: identifier '12' must have 3 or 8 hexadecimal digits",
    ]


TIMES = st.integers(0, 2**53)
NAMES = st.text("abcdefghijklmnopqrstuvwxyz0123456789_-", min_size=1, max_size=15)
WAYS = st.sampled_from(("", "R", "T"))
BASE_IDS, EXTENDED_IDS = st.integers(0, BASE_ID_MAX), st.integers(0, EXTENDED_ID_MAX)
DATA = st.binary(max_size=8)
FRAMES = st.one_of(
    st.builds(Frame, TIMES, BASE_IDS, DATA, interface=NAMES, direction=WAYS),
    st.builds(Frame, TIMES, EXTENDED_IDS, DATA, extended=st.just(True), interface=NAMES, direction=WAYS),
    st.builds(Frame, TIMES, BASE_IDS, remote=st.just(True), dlc=st.integers(0, 8), interface=NAMES),
    st.builds(Frame, TIMES, EXTENDED_IDS, remote=st.just(True), extended=st.just(True), dlc=st.integers(0, 8)),
    st.builds(Frame, TIMES, EXTENDED_IDS, DATA, error=st.just(True), interface=NAMES, direction=WAYS),
    st.builds(Frame, TIMES, BASE_IDS, st.binary(min_size=8, max_size=8), raw_dlc=st.integers(9, 15)),
    st.builds(
        Frame, TIMES, BASE_IDS, st.sampled_from(FD_SIZES).flatmap(lambda size: st.binary(min_size=size, max_size=size)),
        fd=st.just(True), bitrate_switch=st.booleans(), error_state=st.booleans(), direction=WAYS,
    ),
)  # fmt: skip


@given(FRAMES)
def test_frames_survive_their_line(frame: Frame) -> None:
    assert parse_line(format_frame(frame)) == frame


@given(st.one_of(st.text(), st.from_regex(r"\(\d+\.\d*\) can0 [0-9A-F]*#.*")))
def test_any_line_is_read_or_rejected(line: str) -> None:
    try:
        parse_line(line)
    except FrameError as error:
        assert str(error)


@given(st.builds(Frame, st.integers(0, 2**40), BASE_IDS, DATA, direction=st.sampled_from(("R", "T"))))
def test_python_can_reads_what_is_written(frame: Frame) -> None:
    (message,) = can.CanutilsLogReader(io.StringIO(format_frame(frame) + "\n"))
    assert (message.arbitration_id, bytes(message.data)) == (frame.can_id, frame.data)
    assert message.is_rx == (frame.direction == "R")
    assert round(message.timestamp * 1_000_000) == frame.time_us
