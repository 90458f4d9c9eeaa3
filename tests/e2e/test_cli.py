"""The command pdcp, all that talks to an arbitrator, against a running pdcpd; its JSON against tests/e2e/schemas.

Most commands run in the process of the test, which costs a tenth of the time; those that are ended or left alone from
outside run in their own. Tables are looked into for what they must show, not compared to the letter.
"""

import contextlib
import io
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import can
import jsonschema
import pytest
from programs import LINE_TIMEOUT_S, Pdcpd, Program, Value, until
from scripted import ScriptedArbitrator
from simbus import open_sim_bus

from pdcp import ChannelId, Client, EventKind, Identity
from pdcp.cli import app
from pdcp.cli.common import run
from pdcp.counters import GROUPS
from pdcp.events import AuditDifference, CanFrame
from pdcp.model import ProfileState
from pdcp.wire import Frame

COMMAND = Path(sys.executable).with_name("pdcp")
SCHEMAS = Path(__file__).resolve().parent / "schemas"
RUN_TIMEOUT_S = 60.0  # only a command that hangs takes as long
BEACON_ID = 0x100  # of the arbitrator

Json = Any
Start = Callable[..., Pdcpd]
StartNode = Callable[..., Program]


class Result(NamedTuple):
    status: int
    output: str
    error: str

    def words(self) -> str:
        """The output without what is only there for the eye."""
        return " ".join(self.output.split())

    def json(self, schema: str) -> Json:
        """The output as JSON that follows a schema."""
        assert (self.status, self.error) == (0, "")
        data = json.loads(self.output)
        check(data, schema)
        return data


def check(data: Json, schema: str) -> None:
    rules = json.loads((SCHEMAS / f"{schema}.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(rules)
    jsonschema.validate(data, rules, jsonschema.Draft202012Validator)


class Cli:
    """Runs pdcp at the port of a pdcpd."""

    def __init__(self, port: str | None) -> None:
        self.environment = {key: value for key, value in os.environ.items() if key not in ("PDCP_PORT", "COLUMNS")}
        if port is not None:
            self.environment["PDCP_PORT"] = port

    def start(self, *words: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [COMMAND, *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=self.environment,
        )

    def __call__(self, *words: str) -> Result:
        output, error = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
        with (
            mock.patch.dict(os.environ, self.environment, clear=True),
            contextlib.redirect_stdout(output),
            contextlib.redirect_stderr(error),
        ):
            status = run(app, words)
        for stream in (output, error):
            stream.seek(0)
        return Result(int(status), output.read(), error.read())

    def process(self, *words: str) -> Result:
        """The same as a user does it."""
        process = self.start(*words)
        try:
            output, error = process.communicate(timeout=RUN_TIMEOUT_S)
        finally:
            process.kill()
        return Result(process.returncode, output, error)

    def good(self, *words: str) -> Result:
        result = self(*words)
        assert (result.status, result.error) == (0, ""), f"pdcp {' '.join(words)}"
        return result

    def fails(self, status: int, *words: str) -> str:
        """A run that must fail, with one line on standard error, which is returned."""
        result = self(*words)
        assert (result.status, result.output) == (status, ""), f"pdcp {' '.join(words)}: {result.error}"
        lines = result.error.splitlines()
        assert len(lines) == 1 and lines[0].startswith("pdcp: "), lines
        return lines[0]


def await_limb(port: str) -> str:
    """Three devices, four inputs, four outputs, and the profile layer's start-up is over, which comes half a second
    after the last setup and tells its configuration: from now on a limb that is left alone rests. Returns the port."""
    with Client(port) as client:
        until(lambda: client.system_info()[:3] == (3, 4, 4), "the limb is set up")
        until(lambda: client.info().profile_state is ProfileState.RUNNING, "the start-up is over")
    return port


@pytest.fixture
def limb_cli(limb: Start, tmp_path: Path) -> Callable[..., Cli]:
    """limb_cli(ARGUMENT...): pdcp at a new limb of three devices, without links."""

    def start_limb(*arguments: str | Path) -> Cli:
        return Cli(await_limb(limb(*arguments).port()))

    return start_limb


@pytest.fixture(scope="module")
def quiet(request: pytest.FixtureRequest) -> Iterator[Cli]:
    """A limb that tests only look at. Its one link is from D1.1 to D2.2."""
    folder = request.config.getoption("--bin", Path("build/default/bin"))
    nodes = [word for name in ("d1", "d2", "d3") for word in ("--node", f"tools/demo.d/{name}.ini")]
    with Pdcpd(folder, "--can", "sim", "--host", "pty", "--no-autoconfig", *nodes) as pdcpd:
        cli = Cli(await_limb(pdcpd.port()))
        cli.good("link", "2:2:4.1", "2:2:5.2")
        yield cli


def number_of(cli: Cli, device: str) -> int:
    """Its place in the list."""
    rows = cli("devices", "--json", "--no-names").json("devices")
    number: int = next(row["number"] for row in rows if row["id"] == device)
    return number


# --- looking ---


def test_info(quiet: Cli) -> None:
    data = quiet("info", "--json").json("info")
    assert (data["devices"], data["inputs"], data["outputs"], data["links"]) == (3, 4, 4, 1)
    assert data["arbitrator"]["flags"]["autoconfigure"] is False
    words = quiet.good("info").words()
    assert f"devices 3 of {data['arbitrator']['limits']['devices']}" in words
    assert "(4 inputs, 4 outputs)" in words and data["arbitrator"]["firmware"] in words


def test_devices(quiet: Cli) -> None:
    data = quiet("devices", "--json").json("devices")
    assert {(row["id"], row["name"]) for row in data} == {
        ("2:2:4", "D1 sensor"), ("2:2:5", "D2 controller"), ("2:2:6", "D3 hand"),
    }  # fmt: skip
    assert [row["number"] for row in data] == [1, 2, 3]
    assert "2:2:5 D2 controller 0000h 0000h" in quiet.good("devices").words()
    assert "D2 controller" not in quiet.good("devices", "--no-names").output


def test_inputs_and_outputs(quiet: Cli) -> None:
    data = quiet("--json", "inputs").json("channels")
    wrist = next(row for row in data if row["id"] == "2:2:6.1")
    assert (wrist["direction"], wrist["name"], wrist["type"], wrist["profile"]) == (
        "input", "wrist motor", 0x5300, 0x1110,
    )  # fmt: skip
    assert wrist["type_text"] == "8 bits, unsigned, position, sole access, terminal"
    assert len(data) == 4
    data = quiet("outputs", "--json").json("channels")
    assert {row["id"] for row in data} == {"2:2:4.1", "2:2:5.3", "2:2:5.4", "2:2:5.5"}
    assert {row["direction"] for row in data} == {"output"}
    assert "2:2:6.1 D3 hand, wrist motor 8 bits" in quiet.good("inputs").words()
    assert "2:2:4.1 D1 sensor, signal 8 bits, unsigned, position" in quiet.good("outputs").words()


def test_links(quiet: Cli) -> None:
    assert quiet("links", "--json").json("links") == [
        {"number": 1, "output": "2:2:4.1", "input": "2:2:5.2", "status": "active"}
    ]
    assert "2:2:4.1 D1 sensor, signal → 2:2:5.2 D2 controller, muscle active" in quiet.good("links").words()


def test_print(quiet: Cli) -> None:
    data = quiet("print", "--json").json("print")
    hand = next(row for row in data["devices"] if row["id"] == "2:2:6")
    assert [channel["id"] for channel in hand["channels"]] == ["2:2:6.1", "2:2:6.2"]
    beacon = next(row for row in hand["parameters"] if row["name"] == "beacon-interval")
    assert (beacon["parameter"], beacon["value"], beacon["raw"]) == (10, {"beacon_interval": 500}, "f401")
    controller = next(row for row in data["devices"] if row["id"] == "2:2:5")
    wrist = next(row for row in controller["channels"] if row["index"] == 3)
    assert next(row for row in wrist["parameters"] if row["name"] == "required")["value"] == [2]
    words = quiet.good("print").words()
    for part in ("2:2:6 D3 hand", "10 beacon-interval 500 ms", "2:2:5.3 wrist", "9 required 2", "sn 4, index 1"):
        assert part in words


@pytest.mark.parametrize("width", [80, 120])
def test_nothing_is_wider_than_the_terminal(quiet: Cli, width: int) -> None:
    cli = Cli(quiet.environment["PDCP_PORT"])
    cli.environment["COLUMNS"] = str(width)
    for command in (["print"], ["inputs"], ["links"], ["stats"], ["info"], ["--help"], ["set", "--help"]):
        lines = cli.good(*command).output.splitlines()
        assert max(len(line) for line in lines) <= width, command


def test_stats(quiet: Cli) -> None:
    """2413h: names for all counters that the arbitrator has, and no more."""
    data = quiet("stats", "--json").json("stats")
    assert [group["name"] for group in data] == ["bus", "host", "storage", "drivers"]
    for group in data:
        names = [counter["name"] for counter in group["counters"]]
        assert not [name for name in names if name.startswith("counter_")], f"group {group['name']} has more counters"
        assert len(set(names)) == len(names)
    assert [len(group["counters"]) for group in data] == [len(group.counters) for group in GROUPS]
    bus = {counter["name"]: counter["value"] for counter in data[0]["counters"]}
    assert bus["bind_granted"] == 3 and bus["rx"] > bus["requests"] > 20 and bus["no_answer"] == 0
    (host,) = quiet("stats", "host", "--json").json("stats")
    assert (host["group"], host["name"]) == (1, "host")
    assert quiet("stats", "1", "--json").json("stats")[0]["name"] == "host"
    assert "bind_granted 3 bind requests granted" in quiet.good("stats", "bus").words()
    assert "no group" in quiet.fails(2, "stats", "nosuch")
    assert "out of range" in quiet.fails(1, "stats", "99")


# --- parameters ---


@pytest.mark.parametrize("target", ["2:2:6", "0x2:0x2:6", "NUMBER", "#NUMBER"])
def test_get_of_a_device(quiet: Cli, target: str) -> None:
    target = target.replace("NUMBER", str(number_of(quiet, "2:2:6"))) if "NUMBER" in target else target
    data = quiet("get", target, "descriptor", "--json").json("get")
    assert (data["id"], data["kind"], data["parameter"], data["value"]) == ("2:2:6", "device", 7, "D3 hand")
    assert quiet.good("get", target, "7").output == "D3 hand\n"


def test_get_of_a_channel(quiet: Cli) -> None:
    rows = quiet("inputs", "--json", "--no-names").json("channels")
    number = next(row["number"] for row in rows if row["id"] == "2:2:6.2")
    device = number_of(quiet, "2:2:6")
    for target in ("2:2:6.2", f"#{device}.2", f"{device}.2", f"in#{number}", f"in{number}"):
        data = quiet("get", target, "2", "--json").json("get")
        assert (data["id"], data["kind"], data["value"]) == ("2:2:6.2", "input", "grip motor")
    assert quiet("get", "2:2:4.1", "node-id", "--json").json("get")["kind"] == "output"
    assert quiet.good("get", "2:2:6.2", "type", "--raw").output == "00 73 20 12\n"
    assert quiet.good("get", "2:2:6.2", "enabled").output == "off\n"


def test_get_all(quiet: Cli) -> None:
    data = quiet("get", "2:2:5.3", "--json").json("get_all")
    assert [row["name"] for row in data["parameters"]] == [
        "type", "descriptor", "transfer-type", "enabled", "node-id", "required", "desired",
    ]  # fmt: skip
    assert "9 required 2" in quiet.good("get", "2:2:5.3").words()


WRITABLE = """
[parameter 7 0]
value = Before
capacity = 40

[parameter 200 0]
value = {long}
capacity = 512
"""


@pytest.fixture
def writable(limb_cli: Callable[..., Cli], files: dict[str, Path]) -> Cli:
    """The limb, with two parameters of D1 that can be written; 200 is long."""
    with files["d1"].open("a", encoding="utf-8") as file:
        file.write(WRITABLE.format(long="x" * 150))
    return limb_cli()


def test_set(writable: Cli) -> None:
    """Numbers, hexadecimal bytes, text; by name and by number."""
    for words, shown in [
        (["descriptor", "After all"], "After all"),
        (["7", "text:ä, b"], "ä, b"),
        (["7", "hex:48 69"], "Hi"),
        (["7", "two", "words"], "two words"),
        (["beacon-interval", "400"], "400 ms"),
        (["10", "0x1F4"], "500 ms"),
        (["10", "u16:600"], "600 ms"),
        (["0x0a", "hex:F401"], "500 ms"),
    ]:
        assert writable.good("set", "2:2:4", *words).output.endswith(f" set to {shown}\n")
        assert writable.good("get", "2:2:4", words[0]).output == f"{shown}\n"
    assert writable.good("set", "2:2:4.1", "enabled", "on").output == "2:2:4.1: enabled set to on\n"
    assert writable.good("get", "2:2:4.1", "enabled").output == "on\n"


def test_long_values(writable: Cli) -> None:
    """D-BUS-13: up to 512 bytes both ways; the arbitrator refuses a longer one."""
    assert bytes.fromhex(writable.good("get", "2:2:4", "200", "--raw").output) == b"x" * 150
    value = bytes(range(256)) * 2
    data = writable("set", "2:2:4", "200", f"hex:{value.hex()}", "--json").json("set")
    assert data == {"id": "2:2:4", "parameter": 200, "raw": value.hex()}
    assert writable("get", "2:2:4", "200", "--json").json("get")["raw"] == value.hex()
    assert "longer than" in writable.fails(2, "set", "2:2:4", "200", f"hex:{value.hex()}00")


def test_set_that_is_refused(quiet: Cli) -> None:
    assert quiet.fails(1, "set", "2:2:4", "serial-number", "9").endswith(
        "2:2:4, serial-number: the device refused (error 06h)"
    )
    assert quiet.fails(1, "set", "9:9:9", "descriptor", "x").endswith("9:9:9, descriptor: unknown device (error 03h)")
    assert "2:2:4.9, parameter 200: " in quiet.fails(1, "set", "2:2:4.9", "200", "u8:1")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["9:9:9"], "9:9:9: unknown device (error 03h)"),
        (["2:2:4.9"], "2:2:4.9: unknown channel or wrong direction (error 04h)"),
        (["2:2:4", "99"], "2:2:4, parameter 99: the device refused (error 06h)"),
    ],
)
def test_get_that_is_refused(quiet: Cli, words: list[str], told: str) -> None:
    """What was asked for stands in front; a target that nobody knows is no table of failures."""
    assert quiet.fails(1, "get", *words).endswith(told)


# --- links ---


def test_link_and_unlink(limb_cli: Callable[..., Cli]) -> None:
    cli = limb_cli()
    data = cli("link", "2:2:4.1", "2:2:5.2", "--json").json("link")
    assert data == {"output": "2:2:4.1", "input": "2:2:5.2", "status": "active"}
    device = {name: number_of(cli, f"2:2:{sn}") for name, sn in (("d2", 5), ("d3", 6))}
    assert cli.good("link", f"#{device['d2']}.3", f"{device['d3']}.1").output == "2:2:5.3 → 2:2:6.1: active\n"
    rows = {row["id"]: row["number"] for row in cli("outputs", "--json", "--no-names").json("channels")}
    rows |= {row["id"]: row["number"] for row in cli("inputs", "--json", "--no-names").json("channels")}
    cli.good("link", f"#{rows['2:2:5.5']}", str(rows["2:2:6.2"]))
    ends = {(row["output"], row["input"]) for row in cli("links", "--json").json("links")}
    assert ends == {("2:2:4.1", "2:2:5.2"), ("2:2:5.3", "2:2:6.1"), ("2:2:5.5", "2:2:6.2")}
    assert cli.good("unlink", "2:2:6.1").output == "2:2:6.1: has no link now\n"
    assert cli("unlink", "2:2:6.1", "--json").json("unlink") == {"input": "2:2:6.1"}
    assert cli("info", "--json").json("info")["links"] == 2
    assert cli("clear", "--yes", "--json").json("action") == {"links": 2}
    assert cli.good("clear").output == "0 links removed\n"
    assert cli("links", "--json").json("links") == []


def test_links_that_cannot_be(quiet: Cli) -> None:
    assert "2:2:6.1 → 2:2:5.2: unknown channel or wrong direction (error 04h)" in quiet.fails(
        1, "link", "2:2:6.1", "2:2:5.2"
    )
    assert "bad value (error 0Fh)" in quiet.fails(1, "link", "2:2:5.3", "2:2:5.1")
    assert "is a device" in quiet.fails(2, "link", "2:2:4", "2:2:5.2")
    assert "there is no output #77" in quiet.fails(1, "link", "77", "2:2:5.2")
    assert "9:9:9.1: unknown device (error 03h)" in quiet.fails(1, "unlink", "9:9:9.1")


# --- the profile layer and what is stored ---


def test_configurations(limb_cli: Callable[..., Cli], tmp_path: Path) -> None:
    """Saved, cleared, loaded, exported, erased, imported."""
    cli = limb_cli("--nvm", tmp_path / "nvm")
    cli.good("link", "2:2:4.1", "2:2:5.2")
    assert cli("save", "--json").json("configuration") == {"active_configuration": 1, "stored_configurations": 1}
    cli.good("link", "2:2:5.3", "2:2:6.1")
    assert cli.good("save", "3").output == "saved; configuration 3 is active, 2 stored\n"
    cli.good("clear", "--yes")
    assert cli("load", "1", "--json").json("configuration")["active_configuration"] == 1
    assert [row["output"] for row in cli("links", "--json").json("links")] == ["2:2:4.1"]
    cli.good("load", "3")
    assert cli("info", "--json").json("info")["links"] == 2
    cli.good("clear", "--yes")
    assert cli.good("load").output == "loaded, 2 links changed; configuration 3 is active, 2 stored\n"  # D-PRO-16
    assert "there is no configuration 2" in cli.fails(1, "load", "2")
    file = tmp_path / "limb.yaml"
    cli.good("config", "export", str(file))
    text = file.read_text(encoding="utf-8")
    assert cli("erase", "3", "--yes", "--json").json("configuration")["stored_configurations"] == 1
    assert cli("config", "import", str(file), "--yes", "--json").json("import")["stored_configurations"] == 2
    assert cli("info", "--json").json("info")["arbitrator"]["stored_configurations"] == 2
    assert cli.good("config", "export").output == text
    cli.good("load", "3")
    assert cli.good("erase", "--yes").output == "erased; none is active, 1 stored\n"
    assert "there is no active configuration" in cli.fails(1, "erase", "--yes")


def test_profile_layer(limb_cli: Callable[..., Cli]) -> None:
    """Acceptance system 2 at the push of a button; then what the other actions find to do."""
    cli = limb_cli()
    assert cli("autoconfig", "now", "--json").json("action") == {"links": 3}
    ends = {(row["output"], row["input"]) for row in cli("links", "--json").json("links")}
    assert ends == {("2:2:4.1", "2:2:5.2"), ("2:2:5.3", "2:2:6.1"), ("2:2:5.5", "2:2:6.2")}
    assert cli.good("autoconfig", "now").output == "0 links made: every terminal input has a link\n"
    assert cli("enforce", "--json").json("action") == {"links": 0}
    cli.good("save")
    assert cli("replace", "--json").json("action") == {"links": 0}
    assert cli("adopt", "--json").json("action") == {"links": 0}


def test_flags(limb_cli: Callable[..., Cli]) -> None:
    cli = limb_cli()

    def flags() -> dict[str, bool]:
        found: dict[str, bool] = cli("info", "--json").json("info")["arbitrator"]["flags"]
        return found

    assert cli("flag", "auto-save", "on", "--json").json("flag") == {"flag": "auto-save", "on": True}
    assert flags()["auto-save"] and flags()["hot-swap"]
    assert cli.good("flag", "hot-swap", "off").output == "hot-swap off\n"
    assert flags()["auto-save"] and not flags()["hot-swap"]
    assert cli("autoconfig", "on", "--json").json("flag") == {"flag": "autoconfigure", "on": True}
    assert flags()["autoconfigure"]
    cli.good("autoconfig", "off")
    assert not flags()["autoconfigure"]
    cli.good("flag", "strict-crc", "on")
    assert flags()["strict-crc"]


# --- devices ---


class Values:
    """What arrives at the hand, without safe values."""

    def __init__(self, pdcpd: Pdcpd) -> None:
        self._queue = pdcpd.values

    def _next(self) -> Value:
        while (value := self._queue.get(timeout=LINE_TIMEOUT_S)).safe:
            pass
        return value

    def await_new(self) -> None:
        """Those that are there already do not count."""
        while not self._queue.empty():
            self._queue.get()
        self._next()

    def until_behind(self, time_ms: int) -> list[Value]:
        """All up to the first one behind this time."""
        values = [self._next()]
        while values[-1].time_ms <= time_ms:
            values.append(self._next())
        return values


@pytest.mark.parametrize(
    ("name", "devices", "why"),
    [("d1", (1, 0, 1), "no device has a terminal input"), ("d3", (1, 2, 0), "no free output fits 2:2:6.1, 2:2:6.2")],
)
def test_why_no_link_was_made(
    start: Start, files: dict[str, Path], name: str, devices: tuple[int, ...], why: str
) -> None:
    pdcpd = start("--node", files[name])
    with Client(pdcpd.port()) as client:
        until(lambda: client.system_info()[:3] == devices, "the device is set up")
        until(lambda: client.info().profile_state is ProfileState.RUNNING, "the start-up is over")
    assert Cli(pdcpd.port())("autoconfig", "now", "--json").json("action") == {"links": 0, "why": why}


def half_a_second(port: str) -> tuple[int, int]:
    """The times of two beacons of the arbitrator, one after the other. An earlier one goes before them: what was on its
    way when this was called has arrived by then."""
    with Client(port) as client:
        client.stream((EventKind.CAN_FRAME,))
        frames = (event for event in client.events(LINE_TIMEOUT_S) if isinstance(event, CanFrame))
        _, begin_ms, end_ms = (frame.time_ms for frame in islice((f for f in frames if f.can_id == BEACON_ID), 3))
        client.stream(())
    return begin_ms, end_ms


def test_suspend_release_reset(limb: Start) -> None:
    pdcpd = limb()
    cli = Cli(await_limb(pdcpd.port()))
    values = Values(pdcpd)
    cli.good("autoconfig", "now")
    values.await_new()
    all_devices = ["2:2:4", "2:2:5", "2:2:6"]
    for device in ([], ["2:2:4", "2:2:5"]):
        whom = device or all_devices
        assert cli("suspend", *(device or ["--all"]), "--json").json("told") == {"devices": whom}
        begin_ms, end_ms = half_a_second(pdcpd.port())
        assert cli.good("release", *device).output == f"{', '.join(whom)}: released\n"
        arrived = values.until_behind(end_ms)
        assert not [value for value in arrived if begin_ms <= value.time_ms <= end_ms]
    cli.good("suspend", "2:2:4", "--ms", "200")
    values.await_new()
    for words in (["2:2:5"], ["--all"]):
        cli.good("reset", *words)
        await_limb(cli.environment["PDCP_PORT"])
        with Client(cli.environment["PDCP_PORT"]) as client:
            until(lambda client=client: [link.status for link in client.links()] == [2, 2, 2], "all links")  # type: ignore[misc]
        values.await_new()
    assert "9:9:9: unknown device" in cli.fails(1, "reset", "9:9:9")
    assert "unknown device" in cli.fails(1, "suspend", "9:9:9")


def test_passthrough(quiet: Cli) -> None:
    """[API 3.3.26]: a frame to the device, and its answer."""
    data = quiet("passthrough", "2:2:4", "03", "09", "00", "--json").json("passthrough")
    assert data == {"id": "2:2:4", "sent": "030900", "answer": "8301090001"}
    assert quiet.good("passthrough", "2:2:5", "030900").output == "83 01 09 00 05\n"
    assert quiet.good("passthrough", "all", "9").output == "09\n"
    assert "(error 0Eh)" in quiet.fails(1, "passthrough", "all", "0B")
    assert "1 to 8 bytes" in quiet.fails(2, "passthrough", "2:2:4", "00" * 9)
    assert "hexadecimal" in quiet.fails(2, "passthrough", "2:2:4", "xy")


# --- events ---


def test_watch(start: Start, start_node: StartNode, files: dict[str, Path]) -> None:
    """A device comes and goes; Ctrl-C ends it well, and the stream with it."""
    pdcpd = start("--can", "sim:0")
    cli = Cli(pdcpd.port())
    node = start_node(pdcpd, files["d1"])
    with Client(pdcpd.port()) as client:
        until(lambda: client.system_info().outputs == 1, "D1 is set up")
    process = cli.start("watch", "--json", "--frames")
    assert process.stdout is not None
    events: list[Json] = []
    killed = False
    for line in process.stdout:
        events.append(json.loads(line))
        check(events[-1], "event")
        if not killed and events[-1]["event"] == "can_frame":
            node.kill()
            killed = True
        if events[-1]["event"] == "device_lost":
            break
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=RUN_TIMEOUT_S)
    assert (process.returncode, error) == (0, "")
    assert events[-1]["id"] == "2:2:4"
    assert cli("info", "--json").json("info")["arbitrator"]["flags"]["event-stream"] is False


def test_watch_as_text(quiet: Cli) -> None:
    """One line an event where there is no terminal; ends after so many."""
    lines = quiet.good("watch", "--frames", "--count", "3").output.splitlines()
    assert len(lines) == 3 and all("frame" in line and "#" in line for line in lines)


AUDIT = Frame(0x2419, 0, bytes.fromhex("09 A8 61 00 00 02 00 02 00 06 00 01 04"))


@pytest.mark.parametrize("option", [[], ["--json"]])
def test_watch_shows_what_the_audit_finds(option: list[str], scripted: Callable[..., ScriptedArbitrator]) -> None:
    """D-API-20, kind 9: which channel, and which parameter of it."""
    peer = scripted(lambda frame: [Frame(0x2417, frame.reference), *([AUDIT] if frame.payload != b"\0" else [])])
    result = Cli(peer.port).good("watch", "--count", "1", *option)
    assert peer.requests[0].payload == b"\x2f\x01"
    if option:
        expected = {"time_ms": 25000, "kind": 9, "event": "audit", "channel": "2:2:6.1", "parameter": 4}
        assert result.json("event") == expected
    else:
        assert result.words() == "25.000 audit 2:2:6.1 had a wrong parameter 4"


def test_the_audit_of_a_limb(limb: Start) -> None:
    """D-BUS-40: somebody else disables an input of the hand. It is told, and values go on."""
    pdcpd = limb("--can", "sim:0")
    cli = Cli(await_limb(pdcpd.port()))
    values = Values(pdcpd)
    cli.good("autoconfig", "now")
    values.await_new()
    with Client(pdcpd.port()) as client, open_sim_bus(pdcpd.bus_port()) as bus:
        hand = next(device for device in client.devices() if device.identity == Identity(2, 2, 6))
        node_id = client.get_parameter(hand.id, 8)[0]
        client.stream((EventKind.AUDIT,))
        bus.send(can.Message(arbitration_id=0x300 | node_id, data=b"\x04\x04\x01\x00", is_extended_id=False))
        event = next(client.events(LINE_TIMEOUT_S))
        assert isinstance(event, AuditDifference)
        assert (event.channel, event.parameter) == (ChannelId(Identity(2, 2, 6), 1), 4)
        client.stream(())
        until(lambda: client.get_parameter(ChannelId(Identity(2, 2, 6), 1), 4) == b"\x01", "the input is enabled again")
    values.await_new()


def test_watch_for_a_time(scripted: Callable[..., ScriptedArbitrator]) -> None:
    """It shows what comes, and ends when the time is over, no earlier."""
    lost = Frame(0x2419, 0, bytes.fromhex("02 A8 61 00 00 02 00 02 00 04 00 10"))
    peer = scripted(lambda frame: [Frame(0x2417, frame.reference), *([lost] if frame.payload != b"\0" else [])])
    start_s = time.monotonic()
    assert Cli(peer.port).good("watch", "--for", "0.5").words() == "25.000 device lost 2:2:4, node 16"
    assert time.monotonic() - start_s >= 0.5
    assert [frame.message for frame in peer.requests] == [0x2416, 0x2416]


# --- without an arbitrator ---


def test_ports(limb: Start, tmp_path: Path) -> None:
    """A running daemon is found, with the link that it made."""
    link = tmp_path / "arbitrator"
    pdcpd = limb("--host", f"pty:{link}")
    port = pdcpd.port()
    cli = Cli(None)
    rows = cli("ports", "--json").json("ports")
    assert [(row["kind"], row["link"], row["pid"]) for row in rows if row["port"] == port] == [
        ("daemon", str(link), pdcpd.process.pid)
    ]
    assert f"{port} daemon pdcpd" in cli.good("ports").words()


def test_version() -> None:
    data = Cli(None)("version", "--json").json("version")
    assert Cli(None).process("version") == Result(0, f"pdcp {data['pdcp']}\n", "")


def test_help_of_every_command() -> None:
    """Each says in the list what it does, and has a help of its own."""
    names = {command.name or str(getattr(command.callback, "__name__", "")) for command in app.registered_commands}
    assert {
        "info", "print", "devices", "inputs", "outputs", "links", "get", "set", "link", "unlink", "clear", "enforce",
        "autoconfig", "save", "load", "erase", "reset", "suspend", "release", "passthrough", "stats", "watch", "dump",
        "busload", "record", "replay", "ports", "version",
    } <= names  # fmt: skip
    words = Cli(None).good("--help").words()
    assert all(f"│ {name} " in words for name in (*names, "config"))
    assert "VID:PID:SN" in words


# --- what goes wrong ---


def test_exit_codes_of_the_process(quiet: Cli) -> None:
    """0 done, 1 the arbitrator said no, 2 wrong use, 3 no connection."""
    assert quiet.process("--json", "info").json("info")["devices"] == 3
    assert quiet.process("get", "9:9:9", "1") == Result(1, "", "pdcp: 9:9:9, vid-pid: unknown device (error 03h)\n")
    assert quiet.process("get", "2:2", "1").status == 2
    assert Cli("/nosuch").process("info").status == 3


def test_the_port_is_an_option_too(quiet: Cli) -> None:
    """It comes before the environment; --baud does not matter to a pty."""
    port = quiet.environment["PDCP_PORT"]
    other = Cli("/nosuch")
    assert other("--port", port, "--baud", "57600", "--json", "info").json("info")["port"] == port


@pytest.mark.parametrize(
    ("words", "part"),
    [
        ([], "Missing command"),
        (["nosuch"], "nosuch"),
        (["info", "--nosuch"], "--nosuch"),
        (["info", "more"], "more"),
        (["--baud", "0", "info"], "--baud"),
        (["--baud", "fast", "info"], "'--baud': must be a valid integer ("),
        (["--timeout", "x", "info"], "--timeout"),
        (["get"], "TARGET"),
        (["get", "2:2"], "'2:2' is no VID:PID:SN"),
        (["get", "2:2:65536"], "65536"),
        (["get", "2:2:4.x"], "'x' is no number"),
        (["get", "0"], "#0"),
        (["get", "2:2:4", "nosuch"], "has no parameter 'nosuch'; it has vid-pid"),
        (["get", "2:2:4", "256"], "256"),
        (["set", "2:2:4", "10"], "VALUE"),
        (["set", "2:2:4", "10", "65536"], "beacon-interval: 65536 is not between 0 and 65535"),
        (["set", "2:2:4", "200", "5"], "parameter 200"),
        (["set", "2:2:4", "10", "hex:5"], "hex:5"),
        (["set", "2:2:4", "10", "u8:256"], "u8:256"),
        (["set", "2:2:4", "7", "hex:"], "one byte"),
        (["autoconfig", "perhaps"], "'WHAT': 'perhaps' is not one of"),
        (["load", "256"], "'N'"),
        (["save", "256"], "'N'"),
        (["flag", "colour", "on"], "colour"),
        (["suspend", "--ms", "65536"], "--ms"),
    ],
)
def test_wrong_use(quiet: Cli, words: list[str], part: str) -> None:
    assert part in quiet.fails(2, *words)


def test_group_without_a_command() -> None:
    """Its help says all there is to say."""
    result = Cli(None)("config")
    assert (result.status, result.error) == (2, "")
    assert "import" in result.output


def test_no_port() -> None:
    assert "PDCP_PORT" in Cli(None).fails(2, "info")


@pytest.mark.parametrize("command", ["info", "devices", "stats", "reset", "watch", "print"])
def test_no_such_port(command: str) -> None:
    assert Cli("/nosuch").fails(3, command) == "pdcp: cannot open /nosuch: No such file or directory"


def test_what_is_no_port(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("hello", encoding="utf-8")
    assert "it is no serial port" in Cli(str(file)).fails(3, "info")
    assert file.read_text(encoding="utf-8") == "hello"


def test_a_port_in_use(quiet: Cli) -> None:
    with Client(quiet.environment["PDCP_PORT"]):
        assert "another program has it open" in quiet.fails(3, "info")


def test_the_daemon_goes_away(limb: Start) -> None:
    pdcpd = limb()
    cli = Cli(await_limb(pdcpd.port()))
    process = cli.start("watch", "--json", "--frames")
    assert process.stdout is not None
    process.stdout.readline()
    pdcpd.kill()
    _, error = process.communicate(timeout=RUN_TIMEOUT_S)
    assert process.returncode == 3
    assert error == f"pdcp: {cli.environment['PDCP_PORT']} is gone\n"


def silent(frame: Frame) -> list[Frame]:
    return []


@pytest.fixture
def scripted(stack: ExitStack) -> Callable[[Callable[[Frame], list[Frame]]], ScriptedArbitrator]:
    """scripted(SCRIPT): something else than pdcpd at the other end."""

    def make(script: Callable[[Frame], list[Frame]]) -> ScriptedArbitrator:
        peer = ScriptedArbitrator(script)
        stack.callback(peer.close)
        return peer

    return make


def test_time_out(scripted: Callable[..., ScriptedArbitrator]) -> None:
    """Nobody answers: a line at the wrong rate, without an arbitrator."""
    peer = scripted(silent)
    assert Cli(peer.port).fails(4, "--timeout", "0.1", "info") == "pdcp: no answer from the arbitrator within 0.1 s"
    assert Cli(peer.port).fails(4, "--timeout", "0.1", "unlink", "2:2:4.1").endswith("0.1 s")


def test_wrong_baud_rate(scripted: Callable[..., ScriptedArbitrator]) -> None:
    """At another rate answers arrive as garbage."""
    peer: ScriptedArbitrator

    def garbage(frame: Frame) -> list[Frame]:
        peer.send(bytes.fromhex("80 F8 06 78 00 E0 FE 66 80 1E 98 06"))
        return []

    peer = scripted(garbage)
    assert "no answer" in Cli(peer.port).fails(4, "--timeout", "0.1", "devices")


def test_something_else_answers(scripted: Callable[..., ScriptedArbitrator]) -> None:
    peer = scripted(lambda frame: [Frame(0x2202, frame.reference, bytes(3))])
    assert "a bad answer to 2201h" in Cli(peer.port).fails(3, "info")


def test_an_arbitrator_of_the_source(scripted: Callable[..., ScriptedArbitrator]) -> None:
    """One that knows only the messages 22xxh and 23xxh is told from one that is broken."""
    peer = scripted(
        lambda frame: [Frame(0x2202, frame.reference, bytes(4)) if frame.message == 0x2201
                       else Frame(0x2200, frame.reference)]
    )  # fmt: skip
    cli = Cli(peer.port)
    assert cli("info", "--json").json("info")["arbitrator"] is None
    assert "only the messages 22xxh and 23xxh" in cli.good("info").words()
    assert "does not know message 2413h" in cli.fails(1, "stats")


def read_all(terminal: int, on_text: Callable[[bytes], None]) -> bytes:
    """What a pseudo-terminal shows until nobody has it open; on_text gets all of it so far, whenever more has come."""
    text = b""
    with contextlib.suppress(OSError):  # the end of a pseudo-terminal
        while data := os.read(terminal, 4096):
            text += data
            on_text(text)
    os.close(terminal)
    return text


@pytest.mark.parametrize(("command", "seen"), [(["get", "2:2:4"], True), (["get", "2:2:4", "node-id"], False)])
def test_progress(command: list[str], seen: bool, scripted: Callable[..., ScriptedArbitrator]) -> None:
    """After a second a terminal gets a bar, on standard error, which goes again; the output stays as it is."""
    shown = threading.Event()

    def answer(frame: Frame) -> list[Frame]:
        if frame.message != 0x2301:
            return [Frame(frame.message + 2, frame.reference, b"\x06")]
        if seen:
            shown.wait(RUN_TIMEOUT_S)  # as if a device were slow
        return [Frame(0x2302, frame.reference, b"\x01\0\0\0")]

    def look(text: bytes) -> None:
        if b"reading parameters" in text:
            shown.set()

    cli = Cli(scripted(answer).port)
    cli.environment["TERM"] = "xterm"
    master, slave = os.openpty()
    process = subprocess.Popen(
        [COMMAND, "--timeout", str(RUN_TIMEOUT_S), *command],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=slave, env=cli.environment,
    )  # fmt: skip
    os.close(slave)
    errors = read_all(master, look)
    output, _ = process.communicate(timeout=RUN_TIMEOUT_S)
    assert process.returncode == 0
    assert b"reading" not in output and b"\x1b" not in output
    assert shown.is_set() is seen, errors


def test_a_reader_that_goes_away(quiet: Cli) -> None:
    """pdcp print | head -1"""
    process = quiet.start("print")
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(RUN_TIMEOUT_S) in (0, 1)
    process.stderr.close()


def test_what_a_device_says_is_not_obeyed(limb_cli: Callable[..., Cli], files: dict[str, Path]) -> None:
    """A descriptor cannot colour, or clear, the terminal."""
    text = files["d1"].read_text(encoding="utf-8").replace("descriptor = D1 sensor", "descriptor = [red]D1[/red]")
    files["d1"].write_text(text, encoding="utf-8")
    cli = limb_cli()
    assert "[red]D1[/red]" in cli.good("devices").output
    assert "[red]D1[/red], signal" in cli.good("outputs").output
    assert "[red]D1[/red]" in cli.good("print").output
    assert cli.good("get", "2:2:4", "descriptor").output == "[red]D1[/red]\n"
