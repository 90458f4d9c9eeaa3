"""Values as people write and read them: identities, channels, parameters (pdcp-bus.md 4), counters, events."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdcp import counters, events, parameters
from pdcp.messages import EventMessage, FormatError
from pdcp.model import ChannelId, Identity, LinkStatus
from pdcp.parameters import Kind, bits_of, channels_of, find

ROOT = Path(__file__).resolve().parents[2]
numbers16 = st.integers(0, 0xFFFF)
identities = st.builds(Identity, numbers16, numbers16, numbers16)

# --- names ---


@pytest.mark.parametrize(
    ("text", "identity"),
    [
        ("2:2:4", Identity(2, 2, 4)),
        ("0x1234:0X56ab:65535", Identity(0x1234, 0x56AB, 65535)),
        ("0002:0010:0", Identity(2, 10, 0)),
    ],
)
def test_identities(text: str, identity: Identity) -> None:
    assert Identity.parse(text) == identity


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "VID:PID:SN"),
        ("2:2", "VID:PID:SN"),
        ("2:2:4:5", "VID:PID:SN"),
        ("2:2:", "'' is no number"),
        ("2:2:AB", "'AB' is no number"),
        ("2:2:0x", "'0x' is no number"),
        ("2:2:65536", "65536"),
        ("2:-1:4", "-1"),
    ],
)
def test_what_is_no_identity(text: str, what: str) -> None:
    with pytest.raises(ValueError, match=re.escape(what)):
        Identity.parse(text)


@given(identities, st.integers(0, 255))
def test_what_is_shown_can_be_read(identity: Identity, index: int) -> None:
    channel = ChannelId(identity, index)
    assert ChannelId.parse(str(channel)) == channel
    assert Identity.parse(str(identity)) == identity


@pytest.mark.parametrize("text", ["2:2:4.256", "2:2:4.", "2:2:4.x", "2:2:4.-1"])
def test_what_is_no_channel(text: str) -> None:
    with pytest.raises(ValueError, match=re.escape(text.rpartition(".")[2] or "''")):
        ChannelId.parse(text)


# --- parameters ---

# kind, name, raw value, as it is shown, as it is decoded
VALUES = [
    (Kind.DEVICE, "vid-pid", "02 00 34 12", "vid 2, pid 4660", {"vid": 2, "pid": 0x1234}),
    (Kind.DEVICE, "serial-number", "04 01", "260", {"sn": 260}),
    (Kind.DEVICE, "ean13-low", "01 00 00 80", "2147483649", {"ean13_low": 0x80000001}),
    (Kind.DEVICE, "version", "02 01 03 00", "firmware 258, hardware 3", {"firmware": 258, "hardware": 3}),
    (Kind.DEVICE, "version", "FF FF FF FF", "firmware 65535, hardware 65535", {"firmware": 0xFFFF, "hardware": 0xFFFF}),
    (Kind.DEVICE, "type", "22 11 44 33", "type 1122h, profile 3344h", {"type": 0x1122, "profile": 0x3344}),
    (Kind.DEVICE, "descriptor", "44 31 C3 A4", "D1ä", "D1ä"),
    (Kind.DEVICE, "descriptor", "1B 5B 32 4A FF", "\ufffd[2J\ufffd", "\x1b[2J\ufffd"),
    (Kind.DEVICE, "node-id", "2C", "44", {"node_id": 44}),
    (Kind.DEVICE, "beacon-interval", "F4 01", "500 ms", {"beacon_interval": 500}),
    # Missing bytes are 0, extra ones are ignored.
    (Kind.DEVICE, "beacon-interval", "32", "50 ms", {"beacon_interval": 50}),
    (Kind.DEVICE, "beacon-interval", "F4 01 07", "500 ms", {"beacon_interval": 500}),
    (Kind.DEVICE, "beacon-interval", "", "0 ms", {"beacon_interval": 0}),
    (
        Kind.INPUT,
        "type",
        "00 53 10 11",
        "8 bits, unsigned, position, sole access, terminal (5300h); Set point > 1110h",
        {"type": 0x5300, "profile": 0x1110},
    ),
    (Kind.INPUT, "transfer-type", "01", "input", {"transfer_type": "input"}),
    (Kind.OUTPUT, "transfer-type", "02", "output", {"transfer_type": "output"}),
    (Kind.OUTPUT, "transfer-type", "07", "7", {"transfer_type": 7}),
    (Kind.OUTPUT, "enabled", "01", "on", {"enabled": True}),
    (Kind.OUTPUT, "enabled", "00", "off", {"enabled": False}),
    (Kind.OUTPUT, "enabled", "02", "2", {"enabled": 2}),
    # D-BUS-7
    (Kind.INPUT, "source-device", "FF FF FF FF", "none", {"vid": 0xFFFF, "pid": 0xFFFF}),
    (Kind.INPUT, "source-channel", "FF FF FF", "none", {"sn": 0xFFFF, "index": 0xFF}),
    (Kind.INPUT, "source-nodes", "00 00", "none", {"device_node": 0, "output_node": 0}),
    (Kind.INPUT, "source-type", "00 00 00 00", "none", {"type": 0, "profile": 0}),
    (Kind.INPUT, "source-channel", "04 00 01", "sn 4, index 1", {"sn": 4, "index": 1}),
    (Kind.INPUT, "source-nodes", "2C FE", "device node 44, output node 254", {"device_node": 44, "output_node": 254}),
    # D-BUS-8
    (Kind.OUTPUT, "required", "20", "2", [2]),
    (Kind.OUTPUT, "required", "", "none", []),
    (Kind.INPUT, "desired", "40 00 01", "1, 23", [1, 23]),
    (Kind.OUTPUT, "node-id", "FE", "254", {"node_id": 254}),
    (Kind.INPUT, "terminal-profile", "20 12", "Power grip (1220h)", {"terminal_profile": 0x1220}),
]


@pytest.mark.parametrize(("kind", "name", "raw", "shown", "decoded"), VALUES)
def test_values(kind: Kind, name: str, raw: str, shown: str, decoded: object) -> None:
    parameter = find(kind, name)
    assert isinstance(parameter, parameters.Parameter)
    assert parameter.show(bytes.fromhex(raw)) == shown
    assert parameter.decode(bytes.fromhex(raw)) == decoded


# Number, name and size of every parameter, from the table of pdcp-bus.md 4; None: any size.
TABLE = {
    Kind.DEVICE: [
        (1, "vid-pid", 4), (2, "serial-number", 2), (3, "ean13-low", 4), (4, "ean13-high", 4), (5, "version", 4),
        (6, "type", 4), (7, "descriptor", None), (8, "node-id", 1), (9, "channels", 1), (10, "beacon-interval", 2),
        (11, "ack-time", 2), (12, "bind-timeout", 2),
    ],
    Kind.INPUT: [
        (1, "type", 4), (2, "descriptor", None), (3, "transfer-type", 1), (4, "enabled", 1), (5, "source-device", 4),
        (6, "source-channel", 3), (7, "source-nodes", 2), (8, "source-type", 4), (9, "required", None),
        (10, "desired", None), (11, "terminal-profile", 2),
    ],
    Kind.OUTPUT: [
        (1, "type", 4), (2, "descriptor", None), (3, "transfer-type", 1), (4, "enabled", 1), (5, "node-id", 1),
        (9, "required", None), (10, "desired", None),
    ],
}  # fmt: skip


@pytest.mark.parametrize("kind", Kind)
def test_the_table_of_parameters(kind: Kind) -> None:
    assert [(each.number, each.name, each.size) for each in parameters.PARAMETERS[kind]] == TABLE[kind]


# kind, parameter, words, bytes
WRITTEN = [
    (Kind.DEVICE, "10", ["500"], "F4 01"),
    (Kind.DEVICE, "beacon_interval", ["0x1F4"], "F4 01"),
    (Kind.DEVICE, "0x0A", ["1"], "01 00"),
    (Kind.DEVICE, "Version", ["1", "0x0102"], "01 00 02 01"),
    (Kind.DEVICE, "descriptor", ["D1", "ä"], "44 31 20 C3 A4"),
    (Kind.INPUT, "type", ["0x5300", "1110h"], "00 53 10 11"),
    (Kind.INPUT, "type", ["5300h", "4368"], "00 53 10 11"),
    (Kind.INPUT, "enabled", ["on"], "01"),
    (Kind.INPUT, "enabled", ["0"], "00"),
    (Kind.INPUT, "transfer-type", ["output"], "02"),
    (Kind.INPUT, "terminal-profile", ["emg"], "00 22"),
    (Kind.OUTPUT, "required", ["2"], "20"),
    (Kind.OUTPUT, "required", ["1,23"], "40 00 01"),
    (Kind.OUTPUT, "required", ["1", "23"], "40 00 01"),
    (Kind.OUTPUT, "required", ["none"], "00"),
]


@pytest.mark.parametrize(("kind", "name", "words", "raw"), WRITTEN)
def test_values_that_are_written(kind: Kind, name: str, words: list[str], raw: str) -> None:
    parameter = find(kind, name)
    assert isinstance(parameter, parameters.Parameter)
    assert parameter.parse(words) == bytes.fromhex(raw)


@pytest.mark.parametrize(
    ("kind", "name", "words", "what"),
    [
        (Kind.DEVICE, "beacon-interval", ["65536"], "65536"),
        (Kind.DEVICE, "beacon-interval", ["-1"], "-1"),
        (Kind.DEVICE, "beacon-interval", ["soon"], "soon"),
        (Kind.DEVICE, "beacon-interval", ["1", "2"], "takes 1 value "),
        (Kind.DEVICE, "version", ["1"], "firmware, hardware"),
        (Kind.OUTPUT, "enabled", ["maybe"], "maybe"),
        (Kind.OUTPUT, "required", ["256"], "256"),
        (Kind.INPUT, "terminal-profile", ["nosuch"], "nosuch"),
    ],
)
def test_values_that_are_none(kind: Kind, name: str, words: list[str], what: str) -> None:
    parameter = find(kind, name)
    assert isinstance(parameter, parameters.Parameter)
    with pytest.raises(ValueError, match=what):
        parameter.parse(words)


FIXED = [each for rows in parameters.PARAMETERS.values() for each in rows if each.size is not None]


@given(st.sampled_from(FIXED), st.binary(min_size=4, max_size=4))
def test_a_value_is_taken_as_it_is_shown(parameter: parameters.Parameter, value: bytes) -> None:
    """In quotes, or word by word as a shell hands it over."""
    assert parameter.size is not None
    value = value[: parameter.size]
    shown = parameter.show(value)
    assert parameter.parse([shown]) == value, shown
    assert parameter.parse(shown.split()) == value, shown


@pytest.mark.parametrize(("kind", "name", "raw", "shown", "decoded"), VALUES)
def test_the_values_above_are_taken_too(kind: Kind, name: str, raw: str, shown: str, decoded: object) -> None:
    parameter = find(kind, name)
    assert isinstance(parameter, parameters.Parameter)
    if shown.isascii():
        assert parameter.show(parameter.parse([shown])) == shown


def test_parameters_by_number_and_name() -> None:
    assert find(Kind.DEVICE, "99") == 99
    assert find(Kind.OUTPUT, "6") == 6
    with pytest.raises(ValueError, match="256"):
        find(Kind.DEVICE, "256")
    with pytest.raises(ValueError, match="a device has no parameter 'colour'; it has vid-pid, serial-number"):
        find(Kind.DEVICE, "colour")
    with pytest.raises(ValueError, match="an input has no parameter"):
        find(Kind.INPUT, "node-id")


@given(st.sets(st.integers(0, 255)))
def test_channels_and_bits(channels: set[int]) -> None:
    """D-BUS-8."""
    assert channels_of(bits_of(sorted(channels))) == sorted(channels)
    assert bits_of([2]) == b"\x20"


@given(st.sampled_from([each for rows in parameters.PARAMETERS.values() for each in rows]), st.binary(max_size=40))
def test_any_value_can_be_shown(parameter: parameters.Parameter, value: bytes) -> None:
    """Also one that a device made up, on one line and without control characters."""
    parameter.decode(value)
    assert parameter.show(value).isprintable()


# --- counters ---


def enumerators(header: str, prefix: str, last: str) -> list[str]:
    """Names of the enum of a C header that ends with a name, without their prefix."""
    text = re.sub(r"/\*.*?\*/", "", (ROOT / header).read_text(encoding="utf-8"), flags=re.S)
    body = next(each for each in re.findall(r"enum \{(.*?)\}", text, flags=re.S) if f"{prefix}{last}" in each)
    names = re.findall(rf"\b{prefix}(\w+)", body)
    assert names.pop() == last
    return [name.lower() for name in names]


def test_bus_counters_are_those_of_the_header() -> None:
    """The names, in the order of pdcp/arbitrator/pdcp_stats.h."""
    names = enumerators("pdcp/arbitrator/pdcp_stats.h", "PDCP_STAT_", "COUNT")
    assert [name for name, _ in counters.BUS.counters] == names


def test_storage_counters_are_those_of_the_header() -> None:
    """Those of the configurations, behind four others, in the order of firmware/store/arb_config.h."""
    names = enumerators("firmware/store/arb_config.h", "ARB_CONFIG_", "COUNTERS")
    ours = [name.removeprefix("configuration_") for name, _ in counters.STORAGE.counters[4:]]
    assert ours == [name.removeprefix("count_") for name in names]


def test_driver_counters_are_those_of_the_header() -> None:
    names = enumerators("firmware/arb_port.h", "ARB_PORT_", "COUNTERS")
    assert [name for name, _ in counters.DRIVERS.counters] == names


def test_more_counters_than_names() -> None:
    stats = counters.name_counters(7, [1, 2])
    assert stats.name == "group 7"
    assert [each.name for each in stats.counters] == ["counter_0", "counter_1"]
    with pytest.raises(KeyError):
        stats["rx"]


# --- events ---

SENSOR, HAND = Identity(2, 2, 4), Identity(2, 2, 6)
EVENTS = [
    (1, "02 00 02 00 04 00 10", events.DeviceBound(1, 7, SENSOR, 16)),
    (2, "02 00 02 00 04 00 10", events.DeviceLost(2, 7, SENSOR, 16)),
    (
        3,
        "02 00 02 00 04 00 01 02 00 02 00 06 00 02 00",
        events.LinkChanged(3, 7, ChannelId(SENSOR, 1), ChannelId(HAND, 2), LinkStatus.GONE),
    ),
    (4, "01 03", events.ConfigurationChanged(4, 7, 1, 3)),
    (5, "45 06 02 0A FF", events.CanFrame(5, 7, 0x645, b"\x0a\xff")),
    (5, "45 06 00", events.CanFrame(5, 7, 0x645, b"")),
    (6, "03 80 FF", events.BusStateChanged(6, 7, events.BusState.SILENT, 128, 255)),
    (9, "02 00 02 00 06 00 02 07", events.AuditDifference(9, 7, ChannelId(HAND, 2), 7)),
    (7, "01 02", events.UnknownEvent(7, 7, b"\x01\x02")),
]


@pytest.mark.parametrize(("kind", "data", "event"), EVENTS)
def test_events(kind: int, data: str, event: events.Event) -> None:
    """host-api.md 3, message 2419h."""
    assert events.parse(EventMessage(kind, 7, bytes.fromhex(data))) == event


@pytest.mark.parametrize(
    ("kind", "data"),
    [(1, "02 00"), (2, ""), (3, "00" * 14), (3, "00" * 14 + "03"), (4, "01"), (5, "45 06 02 0A"), (5, "45"),
     (5, "45 06 09" + "00" * 9), (6, "04 00 00"), (6, "00"), (9, "00" * 7), (9, "00" * 9)],
)  # fmt: skip
def test_events_that_are_none(kind: int, data: str) -> None:
    with pytest.raises(FormatError, match=f"kind {kind}"):
        events.parse(EventMessage(kind, 7, bytes.fromhex(data)))


def test_the_mask() -> None:
    """Bit k asks for kind k + 1."""
    assert [kind.mask for kind in events.EventKind] == [1, 2, 4, 8, 16, 32, 256]
