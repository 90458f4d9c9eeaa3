"""Files that nobody should have written: each ends in a line or a few, and in no more."""

import json
from collections.abc import Callable
from pathlib import Path

import can
import pytest

from pdcp.capture import is_sendable
from pdcp.cli import app
from pdcp.cli.common import json_text, one_line, run
from pdcp.frames import Frame

Hostile = Callable[[bytes], str]


@pytest.fixture
def hostile(tmp_path: Path) -> Hostile:
    def write(content: bytes) -> str:
        path = tmp_path / "file"
        path.write_bytes(content)
        return str(path)

    return write


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"(" + b"9" * 5000 + b".0) can0 123#00\n", ":1: a time of more than 11 digits before the point"),
        (b"(100000000000000.0) can0 123#00\n", ":1: a time of more than 11 digits before the point"),
        ("(\u0661.0) can0 123#00\n".encode(), ":1: not a line of candump -L"),
        (b"(1.0) can0 123#00 " + b"9" * 5000 + b"\n", ":1: '9999999999999999999999999999999999999999...' behind"),
        (b"(1.0) can0 " + b"9" * 5000 + b"#00\n", ":1: identifier '9999999999999999999999999999999999999999...'"),
        (b"(1.0) can0 123#" + b"x" * 5000 + b"\n", ":1: data 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...'"),
        (bytes(range(256)) * 100, ": neither a log of candump -L nor pcap nor pcapng"),
    ],
)
@pytest.mark.parametrize("command", ["dump", "busload"])
def test_a_bad_log(
    hostile: Hostile, capsys: pytest.CaptureFixture[str], command: str, content: bytes, told: str
) -> None:
    path = hostile(content)
    assert run(app, [command, path]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and lines[0].startswith(f"pdcp: {path}{told}") and len(lines[0]) < 450
    assert lines[1] == "pdcp: 1 place could not be read"


def test_a_log_of_many_bad_lines(hostile: Hostile, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(app, ["dump", hostile(b"nonsense\n" * 70000)]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 12
    assert lines[10:] == ["pdcp: others like this are only counted", "pdcp: 70000 places could not be read"]


def test_a_log_with_a_byte_order_mark(hostile: Hostile, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(app, ["dump", hostile(b"\xef\xbb\xbf(1.0) can0 021#01\r\n(1.1) can0 021#01\r\n")]) == 0
    captured = capsys.readouterr()
    assert len(captured.out.splitlines()) == 2 and captured.err == ""


LINKS = b"configurations:\n- configuration: 1\n  links:\n"


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (LINKS + b"  - link: 1\n" * 70000, "line 4: links has 70000 items, more than 65535"),
        (b"configurations: &a [1]\nx: *a\n", "line 2: an alias, which is not allowed here"),
        (b"configurations:\n- &a {configuration: 1, links: []}\n- *a\n", "line 3: an alias, which is not allowed here"),
        (b"configurations: " + b"[" * 3000 + b"]" * 3000, "no YAML: maximum recursion depth"),
        (
            b"configurations:\n- configuration: " + b"9" * 5000 + b"\n  links: []",
            "line 2: configuration must be a number",
        ),
        (b"x\xe2\x80\xae\x85: 1\n", "byte 4: no UTF-8"),
    ],
    ids=["links", "alias", "alias of a configuration", "depth", "digits", "bytes"],
)
def test_a_bad_yaml(hostile: Hostile, capsys: pytest.CaptureFixture[str], content: bytes, told: str) -> None:
    path = hostile(content)
    assert run(app, ["config", "encode", path]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith(f"pdcp: {path}: {told}")


def test_replay_sends_no_frame_as_another(hostile: Hostile, capsys: pytest.CaptureFixture[str]) -> None:
    """A CAN FD frame is no data frame, on a bus without CAN FD."""
    path = hostile(b"(1.0) can0 001##10A\n(1.1) can0 001#R\n(1.2) can0 002#0A\n(1.3) can0 20000004#00\n")
    assert run(app, ["replay", path, "-i", "virtual", "--no-wait"]) == 1
    assert capsys.readouterr().err.splitlines() == [
        f"pdcp: {path}: the CAN FD frame at 1.000000 s cannot be sent",
        f"pdcp: {path}: the error frame at 1.300000 s cannot be sent",
        "2 frames",
        "pdcp: 2 places could not be read",
    ]


def test_what_a_bus_cannot_carry() -> None:
    """python-can's client of socketcand sends remote frames as empty data frames."""
    frames = [
        Frame(0, 1, b"\x0a"),
        Frame(0, 1, remote=True, dlc=0),
        Frame(0, 1, b"\x0a", fd=True),
        Frame(0, 4, bytes(8), error=True),
    ]
    for interface, protocol, sendable in (
        ("virtual", can.CanProtocol.CAN_20, [True, True, False, False]),
        ("virtual", can.CanProtocol.CAN_FD, [True, True, True, False]),
        ("socketcand", can.CanProtocol.CAN_20, [True, False, False, False]),
    ):
        with can.Bus("hostile", "virtual", protocol=protocol) as bus:
            assert [is_sendable(bus, interface, frame) for frame in frames] == sendable


def test_what_is_not_printable_is_escaped() -> None:
    assert one_line("a\x1b[31m\u202eb\n c\u00e4") == "a\\x1b[31m\\u202eb c\u00e4"
    assert len(one_line("x" * 100000)) == 403
    data = {"name": "a\x1b\x9b\u202e\u2028\u00e4\U000e0001"}
    text = json_text(data)
    assert text == '{"name": "a\\u001b\\u009b\\u202e\\u2028\u00e4\\udb40\\udc01"}'
    assert json.loads(text) == data
    assert json.loads(json_text(data, indent=2)) == data
