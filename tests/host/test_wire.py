"""pdcp.wire: framing, checksums and finding messages in anything (host-api.md 1). Whole messages stand here by hand;
their checksums were computed with crcmod, by the polynomials of D-API-1."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdcp.wire import PAYLOAD_MAX, Frame, Receiver, crc8, crc16, encode

SYSTEM_INFO = bytes.fromhex("FE 19 01 22 5A 23 00 00")
SYSTEM_INFO_SUCCESS = bytes.fromhex("FE 19 02 22 5A FB 06 00 03 04 04 00 18 0F")
DEVICE_INFO_FAILURE = bytes.fromhex("FE 19 06 22 5A 35 03 00 02 B2 C1")
MESSAGES = [
    (SYSTEM_INFO, Frame(0x2201, 0x5A)),
    (SYSTEM_INFO_SUCCESS, Frame(0x2202, 0x5A, bytes([3, 4, 4, 0]))),
    (DEVICE_INFO_FAILURE, Frame(0x2206, 0x5A, bytes([2]))),
    (
        bytes.fromhex("FE 19 07 23 5A 29 10 00 02 00 02 00 04 00 01 02 00 02 00 05 00 02 76 5C"),
        Frame(0x2307, 0x5A, bytes.fromhex("02 00 02 00 04 00 01 02 00 02 00 05 00 02")),
    ),
]

frames = st.builds(
    Frame,
    st.integers(0, 0xFFFF),
    st.integers(0, 0xFF),
    st.binary(max_size=40) | st.binary(min_size=PAYLOAD_MAX - 1, max_size=PAYLOAD_MAX),
)


def receive(data: bytes) -> list[Frame]:
    """What a fresh receiver finds, also after it has waited for the rest of a cut message."""
    receiver = Receiver()
    return receiver.on_bytes(data, 0.0) + receiver.on_time(0.1)


def test_check_values() -> None:
    """D-API-1."""
    assert crc8(b"123456789") == 0xF4
    assert crc16(b"123456789") == 0x29B1


@pytest.mark.parametrize(("data", "frame"), MESSAGES)
def test_by_hand(data: bytes, frame: Frame) -> None:
    assert encode(*frame) == data
    assert receive(data) == [frame]


def test_a_payload_too_long_is_refused() -> None:
    assert len(encode(0x2304, 1, bytes(PAYLOAD_MAX))) == 8 + PAYLOAD_MAX + 2
    with pytest.raises(ValueError, match=str(PAYLOAD_MAX)):
        encode(0x2304, 1, bytes(PAYLOAD_MAX + 1))


@given(frames)
def test_round_trip(frame: Frame) -> None:
    assert receive(encode(*frame)) == [frame]


@given(st.lists(frames, max_size=5), st.data())
def test_any_split(sent: list[Frame], data: st.DataObject) -> None:
    """Messages come in pieces of any size."""
    stream = b"".join(encode(*frame) for frame in sent)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    receiver = Receiver()
    found = []
    for begin, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        found += receiver.on_bytes(stream[begin:end], 0.0)
    assert found == sent
    assert receiver.skipped == 0 and receiver.next_s is None


@given(st.lists(st.tuples(st.binary(max_size=30), frames), max_size=4), st.binary(max_size=30))
def test_garbage_between(sent: list[tuple[bytes, Frame]], tail: bytes) -> None:
    """D-API-2: nothing before a message hides it, and nothing but garbage is lost."""
    found = receive(b"".join(garbage + encode(*frame) for garbage, frame in sent) + tail)
    at = 0
    for frame in found:
        if at < len(sent) and frame == sent[at][1]:
            at += 1
    assert at == len(sent)


@given(st.binary(max_size=2000))
def test_garbage_alone(data: bytes) -> None:
    """Nothing stops the receiver: a message behind it is found."""
    receiver = Receiver()
    receiver.on_bytes(data, 0.0)
    receiver.on_time(0.1)
    assert receiver.on_bytes(SYSTEM_INFO, 0.2) == [Frame(0x2201, 0x5A)]


@pytest.mark.parametrize("size", [1, 2, PAYLOAD_MAX + 3, 0xFFFF])
def test_impossible_sizes(size: int) -> None:
    """A header whose size cannot be swallows nothing, although its CRC8 is right."""
    head = bytes.fromhex("02 22 5A") + size.to_bytes(2, "little")
    header = b"\xfe\x19" + head[:3] + bytes([crc8(head)]) + head[3:]
    assert Receiver().on_bytes(header + SYSTEM_INFO, 0.0) == [Frame(0x2201, 0x5A)]


def test_sync_behind_half_a_sync() -> None:
    """D-API-2: FE FE 19."""
    receiver = Receiver()
    assert receiver.on_bytes(b"\xfe" + SYSTEM_INFO, 0.0) == [Frame(0x2201, 0x5A)]
    assert receiver.skipped == 1


@pytest.mark.parametrize("at", range(2, len(SYSTEM_INFO_SUCCESS)))
def test_a_wrong_bit(at: int) -> None:
    """Whatever is damaged, the message is not taken for another one."""
    damaged = bytearray(SYSTEM_INFO_SUCCESS)
    damaged[at] ^= 0x10
    receiver = Receiver()
    found = receiver.on_bytes(bytes(damaged), 0.0) + receiver.on_time(0.1)
    assert found == []
    assert receiver.on_bytes(SYSTEM_INFO, 0.2) == [Frame(0x2201, 0x5A)]
    assert receiver.bad_checksums >= 1


def test_silence_inside_a_message() -> None:
    """D-API-2: after 100 ms what has come is no message, and another one may be inside."""
    receiver = Receiver()
    cut = MESSAGES[3][0][:8] + SYSTEM_INFO
    assert receiver.on_bytes(cut, 5.0) == []
    assert receiver.next_s == pytest.approx(5.1)
    assert receiver.on_time(5.09) == []
    assert receiver.on_time(5.11) == [Frame(0x2201, 0x5A)]
    assert receiver.next_s is None
    assert receiver.skipped == 8
