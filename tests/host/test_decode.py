"""What the decoder makes of frames. The bytes are those of the tables in [PDCP 3.2] and pdcp-bus.md."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdcp.candump import parse_line, read_log
from pdcp.decode import Decoded, Decoder, format_line, to_json
from pdcp.frames import BASE_ID_MAX, EXTENDED_ID_MAX, Frame
from pdcp.model import Identity

VECTORS = Path(__file__).resolve().parents[1] / "vectors"
LOGS = sorted(VECTORS.glob("*.log"))


def frame(text: str) -> Frame:
    """A frame as candump writes it, `211#0A`."""
    return parse_line(f"(0.0) can0 {text}")


def fields(decoded: Decoded) -> dict[str, object]:
    return {each.name: each.value for each in decoded.fields}


def run(*texts: str, decoder: Decoder | None = None) -> Decoded:
    """Decodes all, returns the last."""
    decoder = decoder or Decoder()
    return [decoder.decode(frame(text)) for text in texts][-1]


BOUND = ("611#01020002000400", "311#8111020002000400")
OUTPUT = ("311#030301", "211#8301030102", "311#040501FE", "211#84010501FE")
INPUT = ("311#030301", "211#8301030101")

MESSAGES = [
    # frame, meaning, fields
    ("611#0134127856BC9A", "Bind Device Request", {"requested": 0x11, "identity": "4660:22136:39612"}),
    ("311#811134127856BC9A", "Bind Device Response", {"node": 0x11, "identity": "4660:22136:39612"}),
    ("311#0201", "GetDeviceInfo", {"rest": "01"}),
    ("211#820102", "GetDeviceInfo Response", {"rest": "0102"}),
    ("311#030A00", "Get Device Parameter", {"parameter": 10, "channel": 0}),
    (
        "211#83010A00F401",
        "Get Device Parameter Response",
        {"response": 1, "parameter": 10, "channel": 0, "beacon_interval": 500},
    ),
    ("211#83000C01", "Get Device Parameter Response", {"response": 0, "parameter": 12, "channel": 1}),
    ("211#83020700", "Get Device Parameter Response", {"response": 2, "parameter": 7, "channel": 0}),
    ("311#040B006400", "Set Device Parameter", {"parameter": 11, "channel": 0, "ack_time": 100}),
    (
        "211#84010B006400",
        "Set Device Parameter Response",
        {"response": 1, "parameter": 11, "channel": 0, "ack_time": 100},
    ),
    ("211#84010B00", "Set Device Parameter Response", {"response": 1, "parameter": 11, "channel": 0}),
    ("211#05010203", "IndGetDeviceParameter", {"rest": "010203"}),
    ("311#85010203", "IndGetDeviceParameter Response", {"rest": "010203"}),
    ("211#0601020304", "IndSetDeviceParameter", {"rest": "01020304"}),
    ("311#86", "IndSetDeviceParameter Response", {}),
    ("311#0712", "SetNodeId", {"rest": "12"}),
    ("211#87", "SetNodeId Response", {}),
    ("311#08E803", "Suspend Device", {"time": 1000}),
    ("211#8801E803", "Suspend Device Response", {"response": 1, "time": 1000}),
    ("211#88", "Suspend Device Response", {"response": 1}),  # D-BUS-18
    ("311#09", "Release Device", {}),
    ("211#8900", "Release Device Response", {"response": 0}),
    ("211#89", "Release Device Response", {"response": 1}),
    ("011#0A", "Device Beacon", {}),
    ("100#0A", "Device Beacon", {}),
    ("311#0B", "Reset Device", {}),
    ("211#8B01", "Reset Device Response", {"response": 1}),
    ("311#0C0700", "Configure Get Bulk Data Transfer", {"parameter": 7, "channel": 0}),
    ("311#0C07000D00", "Configure Get Bulk Data Transfer", {"parameter": 7, "channel": 0, "size": 13}),  # D-BUS-3
    (
        "211#8C0107000D01",
        "Configure Get Bulk Data Transfer Response",
        {"response": 1, "parameter": 7, "channel": 0, "size": 269},
    ),
    ("311#0D07000A00", "Configure Set Bulk Data Transfer", {"parameter": 7, "channel": 0, "size": 10}),
    (
        "211#8D0007000A00",
        "Configure Set Bulk Data Transfer Response",
        {"response": 0, "parameter": 7, "channel": 0, "size": 10},
    ),
    ("211#0E05AABBCC", "Bulk Data Transfer", {"packet": 5, "data": "AABBCC"}),
    ("311#8E00", "Bulk Data Transfer Response", {"response": 0}),
    ("211#0F03", "Update Data Channel", {"channel": 3}),
    ("311#8F0103", "Update Data Channel Response", {"response": 1, "channel": 3}),
    ("211#107788", "Reserved System Code 10h", {"rest": "7788"}),
    ("211#4F", "Reserved System Code 4Fh", {"rest": ""}),
    ("211#50", "Device-Specific Code 50h", {"rest": ""}),
    ("211#7F01", "Device-Specific Code 7Fh", {"rest": "01"}),
    ("211#90", "Reserved System Response 90h", {"rest": ""}),
    ("211#CF", "Reserved System Response CFh", {"rest": ""}),
    ("211#D0", "Device-Specific Response D0h", {"rest": ""}),
    ("211#FE", "Device-Specific Response FEh", {"rest": ""}),
]


@pytest.mark.parametrize(("text", "meaning", "expected"), MESSAGES)
def test_every_message(text: str, meaning: str, expected: dict[str, object]) -> None:
    decoded = run(*BOUND, text)
    assert (decoded.meaning, fields(decoded), decoded.problem) == (meaning, expected, "")


@pytest.mark.parametrize("code", ["02", "05", "06", "07", "82", "85", "86", "87"])
def test_deprecated_codes_are_named(code: str) -> None:
    text = next(text for text, _, _ in MESSAGES if text.partition("#")[2].startswith(code))
    assert "deprecated" in run(*BOUND, text).notes


PROBLEMS = [
    ("211#", "there is no function code"),
    ("211#8301", "must have 4 to 8 bytes, has 2"),
    ("211#8901FF", "must have 1 or 2 bytes, has 3"),
    ("011#0A00", "must have 1 byte, has 2"),
    ("311#03010203", "must have 3 bytes, has 4"),
    ("311#040100", "must have 4 to 7 bytes, has 3"),
    ("311#0C070000", "must have 3 or 5 bytes, has 4"),
    ("611#0102000200", "must have 7 bytes, has 5"),
    ("211#00", "the protocol has no such code"),
    ("211#80", "the protocol has no such code"),
    ("211#8A01", "the protocol has no such code"),
    ("211#FF", "the protocol has no such code"),
    ("211#030100", "only the arbitrator sends this"),
    ("311#83010100", "only a device sends this"),
    ("311#0F01", "only a device sends this"),
    ("211#01020002000400", "a bind request has priority 3"),
    ("300#030100", "this is not sent to all"),
    ("311#0A", "an arbitrator beacons to all"),
    ("611#0A", "priority 3 is for Bind Device Request alone"),
    ("611#", "priority 3 is for Bind Device Request alone"),
    ("711#01020002000400", "priority 3 with mode 1 is not used"),
    ("000#0A", "no device has the id 00h"),
    ("0FF#0A", "no device has the id FFh"),
    ("00000211#0A", "PDCP uses base data frames alone"),
    ("211#R", "PDCP uses base data frames alone"),
    ("211##00A", "PDCP uses base data frames alone"),
    ("20000004#0000000000000000", "PDCP uses base data frames alone"),
]


@pytest.mark.parametrize(("text", "problem"), PROBLEMS)
def test_every_reason_why_a_frame_is_ignored(text: str, problem: str) -> None:
    decoded = run(*BOUND, text)
    assert decoded.problem == problem
    assert format_line(decoded).endswith(f" ! {problem}")


DEVICE_VALUES = [
    (1, "34127856", {"vid": 0x1234, "pid": 0x5678}),
    (2, "BC9A", {"sn": 0x9ABC}),
    (3, "01020304", {"ean13_low": 0x04030201}),
    (4, "01000000", {"ean13_high": 1}),
    (5, "01000200", {"firmware": 1, "hardware": 2}),
    (6, "02010403", {"type": 0x0102, "profile": 0x0304}),
    (7, "48616E64", {"descriptor": "Hand"}),
    (7, "FF", {"descriptor": None}),
    (7, "C28541", {"descriptor": "\x85A"}),
    (8, "11", {"node_id": 0x11}),
    (9, "03", {"channels": 3}),
    (10, "F401", {"beacon_interval": 500}),
    (11, "6400", {"ack_time": 100}),
    (12, "E803", {"bind_timeout": 1000}),
    (13, "0102", {"value": "0102"}),
]
INPUT_VALUES = [
    (1, "00531011", {"type": 0x5300, "profile": 0x1110}),
    (2, "C3A4", {"descriptor": "ä"}),
    (3, "01", {"transfer_type": "input"}),
    (4, "01", {"enabled": True}),
    (4, "07", {"enabled": 7}),
    (5, "02000300", {"vid": 2, "pid": 3}),
    (6, "040007", {"sn": 4, "index": 7}),
    (7, "11FE", {"device_node": 0x11, "output_node": 0xFE}),
    (8, "00502021", {"type": 0x5000, "profile": 0x2120}),
    (9, "20", {"required": [2]}),  # D-BUS-8
    (10, "8081", {"desired": [0, 8, 15]}),
    (11, "2012", {"terminal_profile": 0x1220}),
    (12, "01", {"value": "01"}),
]
OUTPUT_VALUES = [
    (1, "00502021", {"type": 0x5000, "profile": 0x2120}),
    (3, "02", {"transfer_type": "output"}),
    (4, "00", {"enabled": False}),
    (5, "FE", {"node_id": 0xFE}),
    (6, "0102", {"value": "0102"}),
    (9, "20", {"required": [2]}),
    (10, "", {"desired": []}),
]


def value_of(decoded: Decoded) -> dict[str, object]:
    found = fields(decoded)
    return {name: value for name, value in found.items() if name not in ("response", "parameter", "channel")}


@pytest.mark.parametrize(("number", "data", "expected"), DEVICE_VALUES)
def test_values_of_a_device(number: int, data: str, expected: dict[str, object]) -> None:
    assert value_of(run(*BOUND, f"211#8301{number:02X}00{data}")) == expected


@pytest.mark.parametrize(("number", "data", "expected"), INPUT_VALUES)
def test_values_of_an_input(number: int, data: str, expected: dict[str, object]) -> None:
    assert value_of(run(*BOUND, *INPUT, f"211#8301{number:02X}01{data}")) == expected


@pytest.mark.parametrize(("number", "data", "expected"), OUTPUT_VALUES)
def test_values_of_an_output(number: int, data: str, expected: dict[str, object]) -> None:
    assert value_of(run(*BOUND, *OUTPUT, f"211#8301{number:02X}01{data}")) == expected


def test_a_channel_that_nothing_is_known_of_stays_raw() -> None:
    assert fields(run(*BOUND, "311#030501")) == {"parameter": 5, "channel": 1}
    assert "node-id" not in format_line(run(*BOUND, "311#030501"))
    assert fields(run(*BOUND, "211#83010501020304")) == {
        "response": 1, "parameter": 5, "channel": 1, "vid": 0x0302, "pid": 4, "bytes_missing": 1,
    }  # fmt: skip


def test_short_and_long_values() -> None:
    """Missing bytes are 0, extra ones are ignored (pdcp-bus.md 4)."""
    assert value_of(run(*BOUND, "211#83010A00F4")) == {"beacon_interval": 0xF4, "bytes_missing": 1}
    assert value_of(run(*BOUND, "211#83010A00F40102")) == {"beacon_interval": 500, "bytes_extra": "02"}


def test_an_input_that_is_not_connected() -> None:
    """D-BUS-7."""
    for value in ("0501FFFFFFFF", "0601FFFFFF", "07010000", "080100000000"):
        decoded = run(*BOUND, *INPUT, f"211#8301{value}")
        assert [each.text for each in decoded.fields[3:]] == ["none", "none"]


def test_node_ids_are_hexadecimal_and_all_else_reads_as_in_get() -> None:
    assert format_line(run(*BOUND, *INPUT, "311#04070111FE")).endswith("device_node=11h output_node=FEh")
    assert format_line(run(*BOUND, *OUTPUT, "311#040501FE")).endswith(
        "parameter=5 (node-id) channel=1 (output) node_id=FEh"
    )
    assert format_line(run(*BOUND, *INPUT, "311#0406013412FE")).endswith("sn=4660 index=254")
    assert format_line(run(*BOUND, "311#040A00F401")).endswith("channel=0 (the device) beacon_interval=500 ms")
    assert format_line(run(*BOUND, *OUTPUT, "311#04040101")).endswith("enabled=on")
    assert format_line(run(*BOUND, *OUTPUT, "211#8301010100502022")).endswith(
        "type=8 bits, unsigned, position (5000h) profile=EMG amplitude (2220h) [nobody asked]"
    )


def test_undefined_response_code() -> None:
    assert "response=7 (not defined)" in format_line(run(*BOUND, "211#8907"))
    assert "response=2 (not defined)" in format_line(run(*BOUND, "211#8902"))
    assert "response=use bulk transfer" in format_line(run(*BOUND, "211#83020700"))


def test_identities_come_from_bind_answers() -> None:
    decoder = Decoder()
    run(*BOUND, decoder=decoder)
    assert decoder.sender(frame("011#0A")) == "2:2:4"
    run("620#0134127856BC9A", "320#812134127856BC9A", decoder=decoder)  # a suggestion binds nobody
    assert decoder.sender(frame("021#0A")) == "node 21h"
    run("621#0134127856BC9A", "321#812134127856BC9A", decoder=decoder)
    assert decoder.sender(frame("021#0A")) == "4660:22136:39612"
    run("620#01020002000400", "320#8120020002000400", decoder=decoder)  # it has moved
    assert decoder.sender(frame("020#0A")) == "2:2:4"
    assert decoder.sender(frame("011#0A")) == "node 11h"


def test_identities_come_from_parameters_1_and_2_too() -> None:
    decoder = Decoder()
    run("311#030100", "211#8301010034127856", "311#030200", "211#83010200BC9A", decoder=decoder)
    assert decoder.sender(frame("011#0A")) == "4660:22136:39612"
    run("211#8301010009000900", decoder=decoder)  # somebody else
    assert decoder.sender(frame("011#0A")) == "node 11h"


def test_senders_without_identity() -> None:
    decoder = Decoder()
    assert decoder.sender(frame("100#0A")) == "arbitrator"
    assert decoder.sender(frame("611#01020002000400")) == "2:2:4"
    assert decoder.sender(frame("211#R")) == "other frames"
    assert decoder.sender(frame("611#0A")) == decoder.sender(frame("611#010200")) == "node 11h"  # no bind requests


def test_channel_data_of_a_known_output() -> None:
    decoded = run(*BOUND, *OUTPUT, "311#030101", "211#8301010100502021", "0FE#F4")
    assert decoded.meaning == "Channel Data"
    assert fields(decoded) == {"output": "2:2:4.1", "profile": 0x2120, "value": 0xF4, "data": "F4"}
    assert decoded.device == Identity(2, 2, 4)


def test_channel_data_is_not_taken_for_a_message() -> None:
    assert run(*BOUND, *OUTPUT, "0FE#0A").meaning == "Channel Data"
    assert run(*BOUND, "0FE#0B00").meaning == "Channel Data or unknown"


VALUES = [
    ("0050", "F4", 244),  # 8 bits, unsigned
    ("0040", "F4", -12),  # signed
    ("0000", "0F", -1),  # 4 bits, signed
    ("0010", "FF", 15),  # 4 bits, unsigned
    ("0090", "FFFF", 4095),  # 12 bits
    ("0080", "0008", -2048),
    ("00C0", "0080", -32768),  # 16 bits, LSB first
    ("00D0", "3412", 0x1234),
    ("0070", "04", True),
    ("0070", "00", False),
]


@pytest.mark.parametrize(("word", "data", "value"), VALUES)
def test_channel_values_by_type(word: str, data: str, value: int) -> None:
    decoded = run(*BOUND, *OUTPUT, f"211#83010101{word}2021", f"0FE#{data}")
    assert fields(decoded)["value"] == value


def test_floats_and_empty_frames_have_no_value() -> None:
    assert "value" not in fields(run(*BOUND, *OUTPUT, "211#8301010100E02021", "0FE#003C"))
    assert "value" not in fields(run(*BOUND, *OUTPUT, "211#8301010100502021", "0FE#"))


def test_an_output_known_from_its_input_alone() -> None:
    """A log that begins late: what an input is told of its source."""
    decoded = run("312#040601040001", "212#84010601040001", "312#04070111FE", "212#8401070111FE", "0FE#01")
    assert fields(decoded)["output"] == "node 11h channel 1"


def test_an_answer_without_value_means_what_was_written() -> None:
    assert (
        run(*BOUND, "311#030301", "211#8301030102", "311#040501FE", "211#84010501", "0FE#01").meaning == "Channel Data"
    )


def test_a_refused_node_id_is_no_output() -> None:
    assert run(*BOUND, "311#040501FE", "211#84000501FE", "0FE#01").meaning == "Channel Data or unknown"


def test_a_node_id_changes_hands() -> None:
    assert run(*BOUND, *OUTPUT, "6FE#0134127856BC9A", "3FE#81FE34127856BC9A", "0FE#0A").meaning == "Device Beacon"
    assert run(*BOUND, *OUTPUT, "611#0134127856BC9A", "311#811134127856BC9A", "0FE#01").meaning != "Channel Data"


def test_bulk_transfers_are_put_together() -> None:
    decoded = run(
        *BOUND, "311#0C0700", "211#8C0107000800", "211#0E0048616E642061", "311#8E01", "211#0E016E64", "311#8E01"
    )
    assert fields(decoded) == {
        "response": 1, "complete": 8, "parameter": 7, "channel": 0, "descriptor": "Hand and",
    }  # fmt: skip


def test_packet_ids_wrap() -> None:
    """D-BUS-9: after 255 comes 0."""
    decoder = Decoder()
    size = 257
    run(
        *BOUND,
        f"311#0D0700{size & 0xFF:02X}{size >> 8:02X}",
        f"211#8D010700{size & 0xFF:02X}{size >> 8:02X}",
        decoder=decoder,
    )
    for number in range(size):
        run(f"311#0E{number & 0xFF:02X}41", decoder=decoder)
        last = run("211#8E01", decoder=decoder)
    assert fields(last)["descriptor"] == "A" * size


def test_answers_that_nobody_asked_for_are_marked() -> None:
    assert "nobody asked" in run(*BOUND, "211#83010A00F401").notes
    assert "nobody asked" not in run(*BOUND, "311#030A00", "211#83010A00F401").notes
    assert "nobody asked" in run(*BOUND, "311#030A00", "211#83010A00F401", "211#83010A00F401").notes
    assert "nobody asked" in run(*BOUND, "311#030A00", "211#83010A01F401").notes


def test_text_that_would_disturb_a_terminal_is_escaped() -> None:
    assert format_line(run(*BOUND, "311#030700", "211#830107001B41C285")).endswith(r'descriptor="\u001bA\u0085"')
    assert format_line(run(*BOUND, "311#030700", "211#83010700C3A4")).endswith('descriptor="ä"')


def test_json_holds_everything() -> None:
    decoded = run(*BOUND, "311#030A00", "211#83010A00F401")
    assert json.loads(json.dumps(to_json(decoded))) == {
        "time": 0.0, "interface": "can0", "direction": None, "kind": "base", "id": 0x211, "raw": "83010A00F401",
        "meaning": "Get Device Parameter Response", "device": "2:2:4", "priority": 1, "from_arbitrator": False,
        "node": 0x11, "code": 0x83, "fields": {"response": 1, "parameter": 10, "channel": 0, "beacon_interval": 500},
        "notes": [], "problem": None,
    }  # fmt: skip


# --- the golden logs -----------------------------------------------------------------------------


def included(log: Path) -> list[Path]:
    """The logs that a log includes, in the order in which they are played."""
    found: list[Path] = []
    for line in log.read_text().splitlines():
        if line.startswith("#! include "):
            other = VECTORS / line.split()[2]
            found += [*included(other), other]
    return found


def dump(log: Path) -> str:
    complaints: list[str] = []
    decoder = Decoder()
    for other in included(log):
        for each in read_log(other.read_text().splitlines(), other.name, complaints.append):
            decoder.decode(each)
    lines = [format_line(decoder.decode(each)) + "\n" for each in read_log(log.open(), log.name, complaints.append)]
    assert complaints == []
    return "".join(lines)


@pytest.mark.parametrize("log", LOGS, ids=lambda log: str(log.stem))
def test_golden_logs_read_as_reviewed(log: Path, request: pytest.FixtureRequest) -> None:
    reviewed = log.with_suffix(".txt")
    if request.config.getoption("--renew"):
        reviewed.write_text(dump(log))
    assert dump(log) == reviewed.read_text()


def test_every_reviewed_text_has_its_log() -> None:
    assert {path.stem for path in VECTORS.glob("*.txt")} - {"CMakeLists"} == {log.stem for log in LOGS}


# --- any frames ----------------------------------------------------------------------------------

NODES = st.sampled_from((0, 0x11, 0x12, 0xFE, 0xFF))
CODES = st.one_of(st.integers(1, 15), st.integers(0x81, 0x8F), st.integers(0, 255))
LIKELY_DATA = st.builds(lambda code, rest: bytes([code, *rest]), CODES, st.lists(st.integers(0, 12), max_size=7))
BASE = st.builds(
    lambda upper, node, data: Frame(0, upper << 8 | node, data),
    st.integers(0, 7), NODES, st.one_of(st.binary(max_size=8), LIKELY_DATA),
)  # fmt: skip
EXTENDED_IDS, DATA = st.integers(0, EXTENDED_ID_MAX), st.binary(max_size=8)
ANY = st.one_of(
    BASE,
    st.builds(Frame, st.integers(0, 10**15), st.integers(0, BASE_ID_MAX), DATA),
    st.builds(Frame, st.just(0), EXTENDED_IDS, DATA, extended=st.just(True)),
    st.builds(Frame, st.just(0), st.integers(0, BASE_ID_MAX), remote=st.just(True), dlc=st.integers(0, 8)),
    st.builds(Frame, st.just(0), EXTENDED_IDS, DATA, error=st.just(True)),
    st.builds(Frame, st.just(0), EXTENDED_IDS, DATA, extended=st.just(True), fd=st.just(True)),
)


@given(st.lists(ANY, max_size=60))
def test_any_frames_are_decoded(frames: list[Frame]) -> None:
    decoder = Decoder()
    for each in frames:
        decoder.sender(each)
        decoded = decoder.decode(each)
        assert decoded.meaning
        names = [field.name for field in decoded.fields]
        assert len(names) == len(set(names))
        line = format_line(decoded)
        assert line.isprintable()
        json.dumps(to_json(decoded))
