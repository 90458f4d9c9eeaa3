"""Bits on the wire, against examples worked by hand and against a count that puts every bit into a list."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdcp.busload import BusLoad
from pdcp.frames import BASE_ID_MAX, EXTENDED_ID_MAX, Frame
from pdcp.stuffing import INTERFRAME_BITS, frame_bits

ROOT = Path(__file__).resolve().parents[2]

# By hand. Unstuffed, a base frame has 44 bits and 8 for each byte: 1 start, 11 identifier, 3 control (RTR, IDE, r0),
# 4 length, data, 15 CRC, 10 behind it. An extended one has 20 more.
BY_HAND = [
    (Frame(0, 0x2AA, bytes([0x55] * 8)), 108),  # no five equal bits anywhere, CRC included
    (Frame(0, 0x000), 50),  # 34 zeros up to the CRC, which is 0: one stuff bit behind each five but the last four
    (Frame(0, 0x000, bytes(8)), 124),  # 15 zeros, a one, 67 zeros: 3 and 13 stuff bits, none in the CRC
    (Frame(0, 0x000, extended=True), 71),  # 12 zeros, two ones, 25 zeros: 2 and 5 stuff bits, none in the CRC
    (Frame(0, 0x100, b"\x0a"), 55),  # the arbitrator's beacon: 52 and 3
]


def test_the_formula_for_zeros() -> None:
    """n equal bits get a stuff bit behind every five; the stuff bit is of the other level and breaks the run."""
    assert 34 // 5 + 44 == frame_bits(Frame(0, 0)) == 50


@pytest.mark.parametrize(("frame", "bits"), BY_HAND)
def test_examples(frame: Frame, bits: int) -> None:
    assert frame_bits(frame) == bits


def known_to_firmware() -> list[tuple[Frame, int]]:
    """The table of tests/unit/test_sim_bus.c, which the simulated bus is tested with."""
    text = (ROOT / "tests/unit/test_sim_bus.c").read_text()
    table = text[text.index("known[] = {") : text.index("for (size_t i", text.index("known[] = {"))]
    found = []
    for body, bits in re.findall(r"\{\{(.*?)\}, (\d+)\}", table):
        values = dict(re.findall(r"\.(\w+) = (0x[0-9A-F]+|\d+|[A-Z_]+)", body))
        kind = values.get("kind", "")
        data = bytes(int(byte, 16) for byte in re.findall(r"0x[0-9A-F]{2}\b", body.partition(".data")[2]))
        dlc = int(values.get("dlc", "0"))
        if kind.endswith("FD"):
            continue
        remote = kind.endswith("REMOTE")
        found.append((
            Frame(
                0, int(values.get("id", "0"), 0), b"" if remote else data.ljust(dlc, b"\0"),
                extended=kind.endswith("EXTENDED"), remote=remote, error=kind.endswith("ERROR"), dlc=dlc,
            ),
            int(bits),
        ))  # fmt: skip
    return found


def test_the_simulated_bus_counts_the_same() -> None:
    known = known_to_firmware()
    assert len(known) >= 15
    assert [frame_bits(frame) for frame, _ in known] == [bits for _, bits in known]


def slow_bits(frame: Frame) -> int:
    """Every bit in a list, as the standard describes the frame; written without a look at the code."""
    bits = [0]
    identifier = f"{frame.can_id:029b}" if frame.extended else f"{frame.can_id:011b}"
    bits += [int(bit) for bit in identifier[:11]]
    if frame.extended:
        bits += [1, 1] + [int(bit) for bit in identifier[11:]] + [int(frame.remote), 0, 0]
    else:
        bits += [int(frame.remote), 0, 0]
    bits += [int(bit) for bit in f"{frame.raw_dlc or frame.dlc:04b}"]
    for byte in frame.data:
        bits += [int(bit) for bit in f"{byte:08b}"]
    # The remainder of the bits, times x^15, by x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1.
    divisor = [1 if power in (15, 14, 10, 8, 7, 4, 3, 0) else 0 for power in range(15, -1, -1)]
    work = bits + [0] * 15
    for at in range(len(bits)):
        if work[at]:
            for offset, bit in enumerate(divisor):
                work[at + offset] ^= bit
    bits += work[-15:]
    wire: list[int] = []
    for bit in bits:
        if len(wire) >= 5 and len(set(wire[-5:])) == 1:
            wire.append(1 - wire[-1])
        wire.append(bit)
    if len(wire) >= 5 and len(set(wire[-5:])) == 1:
        wire.append(1 - wire[-1])
    return len(wire) + 1 + 1 + 1 + 7  # CRC delimiter, acknowledge slot and delimiter, end of frame


DATA = st.one_of(st.binary(max_size=8), st.lists(st.sampled_from((0, 0xFF, 0x0F, 0xF8)), max_size=8).map(bytes))
FRAMES = st.one_of(
    st.builds(Frame, st.just(0), st.integers(0, BASE_ID_MAX), DATA),
    st.builds(Frame, st.just(0), st.integers(0, EXTENDED_ID_MAX), DATA, extended=st.just(True)),
    st.builds(
        lambda can_id, extended, dlc: Frame(0, can_id, extended=extended, remote=True, dlc=dlc),
        st.integers(0, BASE_ID_MAX), st.booleans(), st.integers(0, 8),
    ),
    st.builds(lambda can_id, data, raw: Frame(0, can_id, data, raw_dlc=raw),
              st.integers(0, BASE_ID_MAX), st.binary(min_size=8, max_size=8), st.integers(9, 15)),
)  # fmt: skip


@given(FRAMES)
def test_stuff_bits_are_exact(frame: Frame) -> None:
    assert frame_bits(frame) == slow_bits(frame)


@given(st.builds(Frame, st.just(0), st.integers(0, BASE_ID_MAX), st.binary(min_size=8, max_size=8)))
def test_eight_bytes_take_108_to_132_bits(frame: Frame) -> None:
    assert 108 <= frame_bits(frame) <= 132


def test_can_fd_has_no_length() -> None:
    with pytest.raises(ValueError, match="CAN FD"):
        frame_bits(Frame(0, 1, fd=True))


BEACON_BITS = 55 + INTERFRAME_BITS


def beacon(time_us: int) -> Frame:
    return Frame(time_us, 0x100, b"\x0a")


def test_mean_and_peak() -> None:
    load = BusLoad(100_000)
    for time_us in (5_000_000, 5_010_000, 5_099_999, 5_300_000):
        load.add(beacon(time_us), "arbitrator")
    load.add(Frame(5_000_500, 0), "D")
    first, last = load.windows()
    assert (first.start_us, first.total.frames, first.total.bits) == (5_000_000, 4, 3 * BEACON_BITS + 53)
    assert (last.start_us, last.total.frames, last.total.bits) == (5_300_000, 1, BEACON_BITS)
    total = load.total()
    assert (total.frames, total.bits) == (5, 4 * BEACON_BITS + 53)
    assert total.mean == pytest.approx((4 * BEACON_BITS + 53) / 400_000)  # four windows of 100 ms, two of them empty
    assert total.peak == pytest.approx((3 * BEACON_BITS + 53) / 100_000)
    arbitrator, device = load.senders()
    assert (arbitrator.sender, arbitrator.frames, arbitrator.bits) == ("arbitrator", 4, 4 * BEACON_BITS)
    assert (device.sender, device.frames, device.bits) == ("D", 1, 53)
    assert device.peak == pytest.approx(53 / 100_000)


def test_a_full_bus_is_one() -> None:
    """Frames back to back: 1000000 bits in a second."""
    load = BusLoad(1_000_000)
    bits = 0
    while bits + BEACON_BITS <= 1_000_000:
        load.add(beacon(bits), "arbitrator")
        bits += BEACON_BITS
    assert load.total().peak == pytest.approx(1.0, abs=0.0001)
    assert len(load.windows()) == 1


def test_times_that_go_back_are_windows_too() -> None:
    load = BusLoad(100_000)
    load.add(beacon(1_000_000), "a")
    load.add(beacon(750_000), "a")
    assert [window.start_us for window in load.windows()] == [700_000, 1_000_000]
    assert load.total().mean == pytest.approx(2 * BEACON_BITS / 400_000)


def test_nothing_is_no_load() -> None:
    load = BusLoad(1000)
    assert (load.total().frames, load.total().mean, load.total().peak) == (0, 0.0, 0.0)
    assert load.senders() == [] and load.windows() == []


def test_can_fd_frames_are_told_apart() -> None:
    load = BusLoad(1000)
    load.add(Frame(0, 1, fd=True), "other frames")
    assert load.uncounted == 1 and load.total().frames == 0
