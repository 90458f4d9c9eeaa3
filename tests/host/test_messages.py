"""pdcp.messages: every message of [API 3.2, 3.3] and of the group 24xxh (D-API-5), as bytes written by hand."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdcp import messages as m
from pdcp.messages import MESSAGES, Failure, FormatError, Message, Request, unpack
from pdcp.model import ChannelId, Identity
from pdcp.wire import Frame

SENSOR = Identity(0x1234, 0x5678, 0x9ABC)
HAND = Identity(0x0002, 0x0003, 0x0104)
SENSOR_BYTES = "34 12 78 56 BC 9A"
HAND_BYTES = "02 00 03 00 04 01"

# id, message, payload
ROWS: list[tuple[int, Message, str]] = [
    (0x2200, m.UnknownId(), ""),
    (0x2201, m.GetSystemInfo(), ""),
    (0x2202, m.SystemInfoSuccess(3, 4, 5, 6), "03 04 05 06"),
    (0x2203, m.SystemInfoFailure(1), "01"),
    (0x2204, m.GetDeviceInfo(7), "07"),
    (0x2205, m.DeviceInfoSuccess(ChannelId(SENSOR, 0), 0x1122, 0x3344), f"{SENSOR_BYTES} 00 22 11 44 33"),
    (0x2206, m.DeviceInfoFailure(2), "02"),
    (0x2207, m.GetInputInfo(8), "08"),
    (0x2208, m.InputInfoSuccess(ChannelId(SENSOR, 1), 0x5300, 0x1110), f"{SENSOR_BYTES} 01 00 53 10 11"),
    (0x2209, m.InputInfoFailure(2), "02"),
    (0x220A, m.GetOutputInfo(9), "09"),
    (0x220B, m.OutputInfoSuccess(ChannelId(HAND, 2), 0x5000, 0x2120), f"{HAND_BYTES} 02 00 50 20 21"),
    (0x220C, m.OutputInfoFailure(2), "02"),
    (0x220D, m.GetLinkInfo(10), "0A"),
    (
        0x220E,
        m.LinkInfoSuccess(ChannelId(SENSOR, 1), ChannelId(HAND, 2), 1),
        f"{SENSOR_BYTES} 01 {HAND_BYTES} 02 01",
    ),
    (0x220F, m.LinkInfoFailure(2), "02"),
    (0x2301, m.GetParameter(ChannelId(SENSOR, 1), 9), f"{SENSOR_BYTES} 01 09"),
    (0x2302, m.GetParameterSuccess(b"hand"), "68 61 6E 64"),
    (0x2303, m.GetParameterFailure(5), "05"),
    (0x2304, m.SetParameter(ChannelId(SENSOR, 0), 10, b"\xf4\x01"), f"{SENSOR_BYTES} 00 0A F4 01"),
    (0x2305, m.SetParameterSuccess(), ""),
    (0x2306, m.SetParameterFailure(6), "06"),
    (0x2307, m.ConfigureLink(ChannelId(SENSOR, 1), ChannelId(HAND, 2)), f"{SENSOR_BYTES} 01 {HAND_BYTES} 02"),
    (0x2308, m.ConfigureLinkSuccess(2), "02"),
    (0x2309, m.ConfigureLinkFailure(15), "0F"),
    (0x230A, m.Passthrough(SENSOR, 3, b"\x03\x07\0\0\0\0\0\0"), f"{SENSOR_BYTES} 03 03 07 00 00 00 00 00 00"),
    (0x230B, m.PassthroughSuccess(SENSOR, 2, b"\x8b\x01\0\0\0\0\0\0"), f"{SENSOR_BYTES} 02 8B 01 00 00 00 00 00 00"),
    (0x230C, m.PassthroughFailure(14), "0E"),
    (0x230D, m.Reset(0), "00"),
    (0x230E, m.ResetSuccess(), ""),
    (0x230F, m.ResetFailure(b"\x05\0\0\0\0\0\0\x80"), "05 00 00 00 00 00 00 80"),
    (0x2401, m.GetArbitratorInfo(), ""),
    (
        0x2402,
        m.ArbitratorInfoSuccess(1, 2, 3, 4, 64, 200, 100, 2, 1, 8, 0x13),
        "01 02 03 04 40 C8 64 02 01 08 13",
    ),
    (0x2403, m.ArbitratorInfoFailure(1), "01"),
    (0x2404, m.SetFlags(0x0F), "0F"),
    (0x2405, m.SetFlagsSuccess(), ""),
    (0x2406, m.SetFlagsFailure(13), "0D"),
    (0x2407, m.ProfileAction(2, 3), "02 03"),
    (0x2408, m.ProfileActionSuccess(0x0102), "02 01"),
    (0x2409, m.ProfileActionFailure(2), "02"),
    (0x240A, m.ReadConfigurations(0x0180, 128), "80 01 80"),
    (0x240B, m.ReadConfigurationsSuccess(0x0200, 0x0180, b"\x0f\0\0"), "00 02 80 01 0F 00 00"),
    (0x240C, m.ReadConfigurationsFailure(13), "0D"),
    (0x240D, m.WriteConfigurations(0x0180, 0x0200, b"\x0f\0\0"), "80 01 00 02 0F 00 00"),
    (0x240E, m.WriteConfigurationsSuccess(), ""),
    (0x240F, m.WriteConfigurationsFailure(15), "0F"),
    (0x2410, m.RemoveLink(ChannelId(HAND, 2)), f"{HAND_BYTES} 02"),
    (0x2411, m.RemoveLinkSuccess(), ""),
    (0x2412, m.RemoveLinkFailure(4), "04"),
    (0x2413, m.GetStatistics(1), "01"),
    (0x2414, m.StatisticsSuccess(1, (0x01020304, 5)), "01 04 03 02 01 05 00 00 00"),
    (0x2415, m.StatisticsFailure(2), "02"),
    (0x2416, m.StreamEvents(0x2F), "2F"),
    (0x2417, m.StreamEventsSuccess(), ""),
    (0x2418, m.StreamEventsFailure(15), "0F"),
    (0x2419, m.EventMessage(4, 0x01020304, b"\x01\x02"), "04 04 03 02 01 01 02"),
]

READS = {0x2201, 0x2204, 0x2207, 0x220A, 0x220D, 0x2301, 0x2401, 0x240A, 0x2413}
SOURCE_IDS = [*range(0x2200, 0x2210), *range(0x2301, 0x2310)]


def test_every_message_has_its_row() -> None:
    """31 of the source, 25 of the extension."""
    assert [row[0] for row in ROWS] == SOURCE_IDS + list(range(0x2401, 0x241A)) == sorted(MESSAGES)
    assert len(SOURCE_IDS) == 31


@pytest.mark.parametrize(("number", "message", "payload"), ROWS, ids=[f"{row[0]:04X}h" for row in ROWS])
def test_bytes(number: int, message: Message, payload: str) -> None:
    data = bytes.fromhex(payload)
    assert number == message.ID
    assert message.pack() == data
    assert unpack(Frame(number, 1, data)) == message


@pytest.mark.parametrize(("number", "message", "payload"), ROWS, ids=[f"{row[0]:04X}h" for row in ROWS])
def test_wrong_sizes(number: int, message: Message, payload: str) -> None:
    """A byte too few or too many; those of any length take what there is."""
    data = bytes.fromhex(payload)
    open_end = number in (0x2302, 0x2304, 0x240B, 0x240D, 0x2414, 0x2419)
    too_many = b"\0\0" if number == 0x2416 else b"\0"  # a mask of two bytes is one, too
    if not open_end:
        with pytest.raises(FormatError, match=f"{number:04X}h"):
            unpack(Frame(number, 1, data + too_many))
    if data and not open_end:
        with pytest.raises(FormatError, match=f"{number:04X}h"):
            unpack(Frame(number, 1, data[:-1]))
    if number in (0x2414,):
        with pytest.raises(FormatError):
            unpack(Frame(number, 1, data[:-1]))


def test_a_mask_of_two_bytes() -> None:
    """D-API-20: 2416h takes a mask of 8 or 16 bits; what fits one byte is sent as one."""
    assert m.StreamEvents(0x012F).pack() == b"\x2f\x01"
    assert unpack(Frame(0x2416, 1, b"\x2f\x01")) == m.StreamEvents(0x012F)
    assert unpack(Frame(0x2416, 1, b"\x2f\x00")) == m.StreamEvents(0x2F)
    with pytest.raises(FormatError, match="mask: 65536"):
        m.StreamEvents(0x10000).pack()


@pytest.mark.parametrize("kind", [kind for kind in MESSAGES.values() if issubclass(kind, Request)])
def test_answers(kind: type[Request[Message]]) -> None:
    """Success is id + 1, failure id + 2; what only reads says so."""
    assert kind.success().ID == kind.ID + 1
    assert kind.failure().ID == kind.ID + 2
    assert issubclass(kind.failure(), Failure) or kind.failure() is m.ResetFailure
    assert (kind.ID in READS) == kind.READS


@pytest.mark.parametrize(
    ("message", "what"),
    [
        (m.GetDeviceInfo(256), "number: 256"),
        (m.GetDeviceInfo(-1), "number: -1"),
        (m.GetParameter(ChannelId(Identity(0x10000, 0, 0)), 1), "channel: 65536:0:0"),
        (m.SetParameter(ChannelId(SENSOR), 7, b""), "value: 0 bytes"),
        (m.Passthrough(SENSOR, 1, b"\x09"), "data: 1 bytes"),
        (m.ReadConfigurations(0x10000, 1), "offset: 65536"),
    ],
)
def test_values_that_do_not_fit(message: Message, what: str) -> None:
    with pytest.raises(FormatError, match=what):
        message.pack()


def test_a_message_that_does_not_exist() -> None:
    with pytest.raises(FormatError, match="1234h"):
        unpack(Frame(0x1234, 1))


@given(st.sampled_from(sorted(MESSAGES)), st.binary(max_size=40))
def test_anything_is_read_or_refused(number: int, payload: bytes) -> None:
    """And what is read packs to the same bytes."""
    try:
        message = unpack(Frame(number, 1, payload))
    except FormatError:
        return
    assert message.pack() == payload
