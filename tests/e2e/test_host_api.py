"""The host API on the wire of a running pdcpd [API 3.2, 3.3].

Requests and answers are whole messages, laid out by hand from the source's tables; their checksums were computed with
crcmod, by the polynomials of D-API-1.
"""

import os
import select
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from programs import LINE_TIMEOUT_S, Pdcpd, until
from rawhost import RawHost

from pdcp import ChannelId, Identity, Link, LinkStatus
from pdcp.wire import Frame, crc8, crc16, encode

D1, D2, D3 = Identity(2, 2, 4), Identity(2, 2, 5), Identity(2, 2, 6)
D3_DESCRIPTOR = "02 00 02 00 06 00 00 07"
SYSTEM_INFO = "FE 19 01 22 5A 23 00 00"
SYSTEM_INFO_OF_LIMB = "FE 19 02 22 5A FB 06 00 03 04 04 00 18 0F"
GROUP_HOST = 1  # of the statistics
FULL_S = 0.5  # without taking a byte: the line and what is behind it are full
WATCHED_S = 2.0
IDLE_TICKS = 10  # of 200; a daemon that spins uses most of them
MESSAGE_MIN = 11  # a failure answer

Start = Callable[..., Pdcpd]
Connect = Callable[[Pdcpd], RawHost]
Row = tuple[str, str, str]  # what it is, request, answer

# fmt: off
TABLES: list[Row] = [
    ("system info", "FE 19 01 22 5A 23 00 00", "FE 19 02 22 5A FB 06 00 03 04 04 00 18 0F"),
    (
        "device 1",
        "FE 19 04 22 5A F1 03 00 01 D1 F1",
        "FE 19 05 22 5A 45 0D 00 02 00 02 00 04 00 00 00 00 00 00 1D 73",
    ),
    (
        "device 2",
        "FE 19 04 22 5A F1 03 00 02 B2 C1",
        "FE 19 05 22 5A 45 0D 00 02 00 02 00 05 00 00 00 00 00 00 7C CB",
    ),
    (
        "device 3",
        "FE 19 04 22 5A F1 03 00 03 93 D1",
        "FE 19 05 22 5A 45 0D 00 02 00 02 00 06 00 00 00 00 00 00 FE 13",
    ),
    ("input 1", "FE 19 07 22 5A 57 03 00 01 D1 F1", "FE 19 08 22 5A B1 0D 00 02 00 02 00 05 00 01 00 72 00 22 65 D3"),
    ("input 2", "FE 19 07 22 5A 57 03 00 02 B2 C1", "FE 19 08 22 5A B1 0D 00 02 00 02 00 05 00 02 00 52 10 21 61 88"),
    ("input 3", "FE 19 07 22 5A 57 03 00 03 93 D1", "FE 19 08 22 5A B1 0D 00 02 00 02 00 06 00 01 00 53 10 11 52 BF"),
    ("input 4", "FE 19 07 22 5A 57 03 00 04 74 A1", "FE 19 08 22 5A B1 0D 00 02 00 02 00 06 00 02 00 73 20 12 B0 E2"),
    (
        "output 1",
        "FE 19 0A 22 5A A3 03 00 01 D1 F1",
        "FE 19 0B 22 5A 17 0D 00 02 00 02 00 04 00 01 00 50 20 21 27 B5",
    ),
    (
        "output 2",
        "FE 19 0A 22 5A A3 03 00 02 B2 C1",
        "FE 19 0B 22 5A 17 0D 00 02 00 02 00 05 00 03 00 50 00 11 70 79",
    ),
    (
        "output 3",
        "FE 19 0A 22 5A A3 03 00 03 93 D1",
        "FE 19 0B 22 5A 17 0D 00 02 00 02 00 05 00 04 00 50 10 12 B4 2D",
    ),
    (
        "output 4",
        "FE 19 0A 22 5A A3 03 00 04 74 A1",
        "FE 19 0B 22 5A 17 0D 00 02 00 02 00 05 00 05 00 70 20 12 B6 04",
    ),
    ("no device 0", "FE 19 04 22 5A F1 03 00 00 F0 E1", "FE 19 06 22 5A 35 03 00 02 B2 C1"),
    ("no device 4", "FE 19 04 22 5A F1 03 00 04 74 A1", "FE 19 06 22 5A 35 03 00 02 B2 C1"),
    ("no device 255", "FE 19 04 22 5A F1 03 00 FF 00 FF", "FE 19 06 22 5A 35 03 00 02 B2 C1"),
    ("no input 5", "FE 19 07 22 5A 57 03 00 05 55 B1", "FE 19 09 22 5A 05 03 00 02 B2 C1"),
    ("no output 5", "FE 19 0A 22 5A A3 03 00 05 55 B1", "FE 19 0C 22 5A E8 03 00 02 B2 C1"),
    ("no link 1", "FE 19 0D 22 5A 8A 03 00 01 D1 F1", "FE 19 0F 22 5A 4E 03 00 02 B2 C1"),
]

WRONG_SIZES: list[Row] = [
    ("system info with a payload", "FE 19 01 22 5A 1C 03 00 01 D1 F1", "FE 19 03 22 5A D8 03 00 01 D1 F1"),
    ("device info without a number", "FE 19 04 22 5A CE 00 00", "FE 19 06 22 5A 35 03 00 01 D1 F1"),
    ("device info with two numbers", "FE 19 04 22 5A 9A 04 00 01 02 7C 0E", "FE 19 06 22 5A 35 03 00 01 D1 F1"),
    ("input info without a number", "FE 19 07 22 5A 68 00 00", "FE 19 09 22 5A 05 03 00 01 D1 F1"),
    ("output info without a number", "FE 19 0A 22 5A 9C 00 00", "FE 19 0C 22 5A E8 03 00 01 D1 F1"),
    ("link info without a number", "FE 19 0D 22 5A B5 00 00", "FE 19 0F 22 5A 4E 03 00 01 D1 F1"),
    (
        "get without a parameter",
        "FE 19 01 23 5A 88 09 00 02 00 02 00 04 00 00 6E 09",
        "FE 19 03 23 5A CE 03 00 01 D1 F1",
    ),
    (
        "get with a byte too many",
        "FE 19 01 23 5A A2 0B 00 02 00 02 00 04 00 00 01 00 C1 04",
        "FE 19 03 23 5A CE 03 00 01 D1 F1",
    ),
    (
        "set without value",
        "FE 19 04 23 5A 5A 0A 00 02 00 02 00 04 00 00 01 08 EF",
        "FE 19 06 23 5A 23 03 00 01 D1 F1",
    ),
    (
        "link without an index",
        "FE 19 07 23 5A BD 0F 00 02 00 02 00 04 00 01 02 00 02 00 05 00 2A BF",
        "FE 19 09 23 5A 13 03 00 01 D1 F1",
    ),
    (
        "link with a byte too many",
        "FE 19 07 23 5A 3C 11 00 02 00 02 00 04 00 01 02 00 02 00 05 00 02 00 79 ED",
        "FE 19 09 23 5A 13 03 00 01 D1 F1",
    ),
]

PARAMETERS: list[Row] = [
    (
        "D1: VID and PID",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 04 00 00 01 08 EF",
        "FE 19 02 23 5A ED 06 00 02 00 02 00 CA 0F",
    ),
    (
        "D1: serial number",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 04 00 00 02 6B DF",
        "FE 19 02 23 5A C7 04 00 04 00 CB D1",
    ),
    (
        "D3: descriptor, by bulk transfer",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 06 00 00 07 A6 62",
        "FE 19 02 23 5A 2E 09 00 44 33 20 68 61 6E 64 71 70",
    ),
    ("D2: node id", "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 00 08 95 08", "FE 19 02 23 5A AC 03 00 20 92 C5"),
    (
        "D2: number of channels",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 00 09 B4 18",
        "FE 19 02 23 5A AC 03 00 05 55 B1",
    ),
    (
        "D1: beacon interval",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 04 00 00 0A 63 5E",
        "FE 19 02 23 5A C7 04 00 F4 01 2B D2",
    ),
    (
        "D1: time to wait for acknowledgement",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 04 00 00 0B 42 4E",
        "FE 19 02 23 5A C7 04 00 64 00 E1 DA",
    ),
    (
        "D1.1: type and profile",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 04 00 01 01 39 DC",
        "FE 19 02 23 5A ED 06 00 00 50 20 21 AB E8",
    ),
    ("D1.1: an output", "FE 19 01 23 5A B7 0A 00 02 00 02 00 04 00 01 03 7B FC", "FE 19 02 23 5A AC 03 00 02 B2 C1"),
    ("D2.2: an input", "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 02 03 9C DF", "FE 19 02 23 5A AC 03 00 01 D1 F1"),
    ("D2.2: disabled", "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 02 04 7B AF", "FE 19 02 23 5A AC 03 00 00 F0 E1"),
    (
        "D2.2: no source",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 02 05 5A BF",
        "FE 19 02 23 5A ED 06 00 FF FF FF FF 0F 1D",
    ),
    (
        "D2.2: no source, serial number and index",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 02 06 39 8F",
        "FE 19 02 23 5A D2 05 00 FF FF FF F0 1E",
    ),
    (
        "D2.2: no source, node ids",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 02 07 18 9F",
        "FE 19 02 23 5A C7 04 00 00 00 0F 1D",
    ),
    (
        "D2.2: no source, type and profile",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 02 08 F7 6E",
        "FE 19 02 23 5A ED 06 00 00 00 00 00 C0 84",
    ),
    (
        "D2.3: requires channel 2",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 03 09 E7 4D",
        "FE 19 02 23 5A AC 03 00 20 92 C5",
    ),
    (
        "D3.1: terminal profile",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 06 00 01 0B 1B 90",
        "FE 19 02 23 5A C7 04 00 10 11 6C 1C",
    ),
    ("unknown device", "FE 19 01 23 5A B7 0A 00 02 00 02 00 07 00 00 01 D4 74", "FE 19 03 23 5A CE 03 00 03 93 D1"),
    ("unknown channel", "FE 19 01 23 5A B7 0A 00 02 00 02 00 04 00 02 01 6A 89", "FE 19 03 23 5A CE 03 00 04 74 A1"),
    (
        "refused: no such parameter",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 04 00 00 63 EC A3",
        "FE 19 03 23 5A CE 03 00 06 36 81",
    ),
    (
        "refused: read-only",
        "FE 19 04 23 5A 0E 0E 00 02 00 02 00 04 00 00 01 01 00 01 00 20 BC",
        "FE 19 06 23 5A 23 03 00 06 36 81",
    ),
    (
        "set: unknown device",
        "FE 19 04 23 5A 4F 0B 00 09 00 02 00 04 00 00 01 01 5B 10",
        "FE 19 06 23 5A 23 03 00 03 93 D1",
    ),
    (
        "set: unknown channel",
        "FE 19 04 23 5A 4F 0B 00 02 00 02 00 04 00 09 04 00 A5 65",
        "FE 19 06 23 5A 23 03 00 04 74 A1",
    ),
    ("set: transfer enabled", "FE 19 04 23 5A 4F 0B 00 02 00 02 00 04 00 01 04 00 04 CC", "FE 19 05 23 5A BA 00 00"),
]

BAD_LINKS: list[Row] = [
    (
        "unknown output device",
        "FE 19 07 23 5A 29 10 00 02 00 02 00 07 00 01 02 00 02 00 05 00 02 B9 ED",
        "FE 19 09 23 5A 13 03 00 03 93 D1",
    ),
    (
        "unknown input device",
        "FE 19 07 23 5A 29 10 00 02 00 02 00 04 00 01 02 00 02 00 07 00 01 75 02",
        "FE 19 09 23 5A 13 03 00 03 93 D1",
    ),
    (
        "no such channel",
        "FE 19 07 23 5A 29 10 00 02 00 02 00 04 00 02 02 00 02 00 05 00 02 03 94",
        "FE 19 09 23 5A 13 03 00 04 74 A1",
    ),
    (
        "both the wrong way round",
        "FE 19 07 23 5A 29 10 00 02 00 02 00 05 00 02 02 00 02 00 04 00 01 15 FC",
        "FE 19 09 23 5A 13 03 00 04 74 A1",
    ),
    (
        "an input as output",
        "FE 19 07 23 5A 29 10 00 02 00 02 00 06 00 01 02 00 02 00 05 00 02 FC 82",
        "FE 19 09 23 5A 13 03 00 04 74 A1",
    ),
    (
        "within one device",
        "FE 19 07 23 5A 29 10 00 02 00 02 00 05 00 03 02 00 02 00 05 00 02 95 BC",
        "FE 19 09 23 5A 13 03 00 0F 1F 10",
    ),
]

UNKNOWN_IDS: list[Row] = [
    ("unknown 2200", "FE 19 00 22 5A 41 00 00", "FE 19 00 22 5A 41 00 00"),
    ("unknown 2202", "FE 19 02 22 5A 85 00 00", "FE 19 00 22 5A 41 00 00"),
    ("unknown 2210", "FE 19 10 22 5A 73 00 00", "FE 19 00 22 5A 41 00 00"),
    ("unknown 1234", "FE 19 34 12 5A 70 05 00 01 02 03 AD AD", "FE 19 00 22 5A 41 00 00"),
    ("unknown FFFF", "FE 19 FF FF 5A 4B 00 00", "FE 19 00 22 5A 41 00 00"),
]

LINKED: list[Row] = [
    (
        "link D1.1 to D2.2",
        "FE 19 07 23 5A 29 10 00 02 00 02 00 04 00 01 02 00 02 00 05 00 02 76 5C",
        "FE 19 08 23 5A 71 03 00 02 B2 C1",
    ),
    (
        "link info",
        "FE 19 0D 22 5A 8A 03 00 01 D1 F1",
        "FE 19 0E 22 5A 51 11 00 02 00 02 00 04 00 01 02 00 02 00 05 00 02 02 3B CD",
    ),
    ("system info", "FE 19 01 22 5A 23 00 00", "FE 19 02 22 5A FB 06 00 03 04 04 01 39 1F"),
    (
        "D2.2: source, VID and PID",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 02 05 5A BF",
        "FE 19 02 23 5A ED 06 00 02 00 02 00 CA 0F",
    ),
    (
        "D2.2: source, serial number and index",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 02 06 39 8F",
        "FE 19 02 23 5A D2 05 00 04 00 01 7D 00",
    ),
    (
        "D2.2: source, type and profile",
        "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 02 08 F7 6E",
        "FE 19 02 23 5A ED 06 00 00 50 20 21 AB E8",
    ),
    ("D2.2: enabled", "FE 19 01 23 5A B7 0A 00 02 00 02 00 05 00 02 04 7B AF", "FE 19 02 23 5A AC 03 00 01 D1 F1"),
]
# fmt: on


def exchange(host: RawHost, request: str) -> str:
    host.send_bytes(bytes.fromhex(request))
    return host.receive_bytes().hex(" ").upper()


def differences(host: RawHost, rows: list[Row]) -> list[str]:
    """Sends each request in turn; the rows that were answered with other bytes."""
    found = []
    for name, request, expected in rows:
        answer = exchange(host, request)
        if answer != expected:
            found.append(f"{name}: {request} was answered by {answer} instead of {expected}")
    return found


@pytest.fixture
def ready(connect: Connect) -> Callable[[Pdcpd], RawHost]:
    """ready(PDCPD): a host, once its three devices are set up."""

    def connect_when_ready(pdcpd: Pdcpd) -> RawHost:
        host = connect(pdcpd)
        until(lambda: host.system_info()[:3] == (3, 4, 4), "three devices with four inputs and four outputs")
        return host

    return connect_when_ready


def processor_ticks(pid: int) -> int:
    """User and system time of a process, in hundredths of a second."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


def test_a_host_that_never_reads_costs_no_processor_time(start: Start) -> None:
    """It asks until nobody takes its requests any more. The daemon sleeps; when the host reads, all is answered."""
    pdcpd = start()
    request = encode(0x2201, 1, b"")
    host = os.open(pdcpd.port(), os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        sent = 0
        waiting_s = time.monotonic()
        while time.monotonic() - waiting_s < FULL_S:
            with suppress(BlockingIOError):
                sent += os.write(host, request)
                waiting_s = time.monotonic()
        before = processor_ticks(pdcpd.process.pid)
        time.sleep(WATCHED_S)
        assert processor_ticks(pdcpd.process.pid) - before <= IDLE_TICKS
        answers = b""
        while len(answers) < sent // len(request) * MESSAGE_MIN:
            if select.select([host], [], [], LINE_TIMEOUT_S)[0] == []:
                pytest.fail(f"{len(answers)} bytes of answers for {sent} bytes of requests")
            answers += os.read(host, 4096)
    finally:
        os.close(host)


def test_checksums_have_their_check_values() -> None:
    """D-API-1"""
    assert (crc8(b"123456789"), crc16(b"123456789")) == (0xF4, 0x29B1)


@pytest.mark.parametrize(
    "rows", [TABLES, WRONG_SIZES, PARAMETERS, BAD_LINKS, UNKNOWN_IDS, LINKED],
    ids=["tables", "wrong sizes", "parameters", "bad links", "unknown ids", "a link"],
)  # fmt: skip
def test_messages(rows: list[Row], limb: Start, ready: Connect) -> None:
    """D-API-1, D-API-3, D-API-4, D-API-6"""
    assert differences(ready(limb()), rows) == []


def test_node_ids_of_link_and_outputs(limb: Start, ready: Connect) -> None:
    """The input knows the node ids of its source: device, then output; ids are unique, from 1 to 254 (D-BUS-2)."""
    host = ready(limb())
    host.link(ChannelId(D1, 1), ChannelId(D2, 2))
    outputs = [output.id for output in host.outputs()]
    ids = [host.get_parameter(channel, 5)[0] for channel in outputs] + [16, 32, 48]
    assert len(set(ids)) == len(ids) == 7
    assert all(1 <= each <= 254 for each in ids)
    assert list(host.get_parameter(ChannelId(D2, 2), 7)) == [16, ids[outputs.index(ChannelId(D1, 1))]]


def test_a_link_again_and_another_source(limb: Start, ready: Connect) -> None:
    """D-API-6: 2307h replaces the input's source; repeated, it succeeds."""
    host = ready(limb())
    target = ChannelId(D3, 1)
    for source in (ChannelId(D1, 1), ChannelId(D1, 1), ChannelId(D2, 3)):
        assert host.link(source, target) is LinkStatus.ACTIVE
        assert host.links() == [Link(1, source, target, LinkStatus.ACTIVE)]


# --- framing ---


def test_lenient_takes_any_checksum(limb: Start, ready: Connect) -> None:
    """D-API-1: as the original, any checksum will do."""
    host = ready(limb())
    rows = [
        ("CRC8", "FE 19 01 22 5A 00 00 00", SYSTEM_INFO_OF_LIMB),
        ("CRC16", "FE 19 04 22 5A F1 03 00 04 00 00", "FE 19 06 22 5A 35 03 00 02 B2 C1"),
        ("both", "FE 19 04 22 5A 00 03 00 04 FF FF", "FE 19 06 22 5A 35 03 00 02 B2 C1"),
    ]
    assert differences(host, rows) == []


def test_strict_refuses_wrong_checksums(limb: Start, ready: Connect) -> None:
    """D-API-1: error 0Ch, and the request is not carried out; an unknown id is unknown all the same."""
    host = ready(limb("--strict-crc"))
    link = bytearray.fromhex(LINKED[0][1])
    link[-1] ^= 1
    rows = [
        ("CRC8", "FE 19 01 22 5A 00 00 00", "FE 19 03 22 5A D8 03 00 0C 7C 20"),
        ("CRC16", "FE 19 04 22 5A F1 03 00 04 00 00", "FE 19 06 22 5A 35 03 00 0C 7C 20"),
        ("link", link.hex(" "), "FE 19 09 23 5A 13 03 00 0C 7C 20"),
        ("not carried out", SYSTEM_INFO, SYSTEM_INFO_OF_LIMB),
        ("unknown id", "FE 19 10 22 5A 00 00 00", "FE 19 00 22 5A 41 00 00"),
        ("right ones", "FE 19 04 22 5A F1 03 00 04 74 A1", "FE 19 06 22 5A 35 03 00 02 B2 C1"),
    ]
    assert differences(host, rows) == []


@pytest.mark.parametrize(
    "rubbish",
    [
        "00", "FE", "FE FE", "FE FE FE FE", "19", "19 FE", "FE 18", "FE 19", "FE FE 19", "FE 19 01 22 5A",
        # A header whose size cannot be: 1, 2, beyond the largest request.
        "FE 19 01 22 5A 00 01 00", "FE 19 01 22 5A 00 02 00", "FE 19 01 22 5A 00 FF FF",
        # Cut in the payload.
        "FE 19 04 22 5A F1 03 00", "FE 19 07 23 5A 29 10 00 02 00 02", "FE 19 04 23 5A 00 00 02 02 00",
        "48 65 6C 6C 6F 0D 0A FF FF 00 7F FE 00 19",
    ],
)  # fmt: skip
def test_a_request_behind_rubbish_is_answered(rubbish: str, limb: Start, ready: Connect) -> None:
    """D-API-2, also in strict mode: FE FE 19 synchronises, and what is cut short swallows nothing."""
    host = ready(limb("--strict-crc"))
    host.send_bytes(bytes.fromhex(rubbish) + encode(0x2201, 0xB7))
    # The cut message may get an answer of its own, with its own reference.
    answer = host.receive()
    while answer.reference == 0x5A:
        answer = host.receive()
    assert answer == Frame(0x2202, 0xB7, bytes([3, 4, 4, 0]))
    assert exchange(host, SYSTEM_INFO) == SYSTEM_INFO_OF_LIMB


def test_a_message_may_come_in_pieces(limb: Start, ready: Connect) -> None:
    """D-API-2: given up only after 100 ms of silence, as a busy machine may make them; then it is sent again."""
    host = ready(limb())
    given_up = 0
    while given_up == host.stats(GROUP_HOST)["given_up"]:
        for byte in bytes.fromhex(SYSTEM_INFO):
            host.send_bytes(bytes([byte]))
        host.send_bytes(encode(0x2201, 0xB7))
        if (answer := host.receive()).reference == 0x5A:
            break
        given_up += 1
    assert answer == Frame(0x2202, 0x5A, bytes([3, 4, 4, 0]))
    assert host.receive().reference == 0xB7


def test_four_requests_in_one_write(limb: Start, ready: Connect) -> None:
    """D-API-3: answered in order, exactly one answer each."""
    host = ready(limb())
    descriptor = bytes.fromhex(D3_DESCRIPTOR)  # needs a bulk transfer first
    host.send_bytes(
        encode(0x2301, 1, descriptor) + encode(0x2204, 2, b"\x04") + encode(0x1234, 3) + encode(0x2301, 4, descriptor)
    )
    assert [host.receive() for _ in range(4)] == [
        Frame(0x2302, 1, b"D3 hand"),
        Frame(0x2206, 2, b"\x02"),
        Frame(0x2200, 3, b""),
        Frame(0x2302, 4, b"D3 hand"),
    ]
    assert exchange(host, SYSTEM_INFO) == SYSTEM_INFO_OF_LIMB


def test_every_reference_comes_back(limb: Start, ready: Connect) -> None:
    host = ready(limb())
    for reference in range(256):
        host.send_bytes(encode(0x2201, reference))
        assert host.receive().reference == reference


def test_host_closes_and_comes_back(limb: Start, ready: Connect, connect: Connect) -> None:
    """A host that leaves in the middle leaves nothing behind for the next one."""
    pdcpd = limb()
    first = ready(pdcpd)
    first.send_bytes(encode(0x2301, 0x11, bytes.fromhex(D3_DESCRIPTOR)))
    first.receive_bytes()
    first.send_bytes(encode(0x2307, 0x12)[:5])
    first.close()
    for _ in range(20):
        with RawHost(pdcpd.port()) as host:
            assert host.system_info() == (3, 4, 4, 0)
    assert exchange(connect(pdcpd), SYSTEM_INFO) == SYSTEM_INFO_OF_LIMB


def test_host_by_a_link(limb: Start, tmp_path: Path) -> None:
    pdcpd = limb("--host", f"pty:{tmp_path / 'arbitrator'}")
    pdcpd.port()
    with RawHost(str(tmp_path / "arbitrator")) as host:
        until(lambda: host.system_info()[:3] == (3, 4, 4), "the limb is set up")
