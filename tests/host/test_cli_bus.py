"""The commands dump, busload, record, replay and profiles, run in this process; buses are lists of messages."""

import io
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import pytest

from pdcp.cli import app, bus
from pdcp.cli.common import run

VECTORS = Path(__file__).resolve().parents[1] / "vectors"
BUS = ["--interface", "virtual", "--channel", "x"]


class ScriptedBus:
    """A bus on which a user presses Ctrl-C when there is nothing more to receive."""

    def __init__(self, *messages: can.Message) -> None:
        self.messages = list(messages)
        self.sent: list[can.Message] = []
        self.full = 0  # so many sends fail, as when the transmit queue is full

    def __enter__(self) -> "ScriptedBus":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def recv(self, timeout: float) -> can.Message | None:
        if not self.messages:
            raise KeyboardInterrupt
        return self.messages.pop(0)

    def send(self, message: can.Message, timeout: float) -> None:
        if self.full:
            self.full -= 1
            raise can.CanOperationError("No buffer space available")
        self.sent.append(message)


def message(time_s: float, can_id: int, data: str) -> can.Message:
    return can.Message(timestamp=time_s, arbitration_id=can_id, data=bytes.fromhex(data), is_extended_id=False)


Pdcp = Callable[..., tuple[int, str, str]]


@pytest.fixture
def pdcp(capsys: pytest.CaptureFixture[str]) -> Pdcp:
    """pdcp(ARGUMENT...): exit status, standard output, standard error."""

    def call(*arguments: object) -> tuple[int, str, str]:
        status = run(app, [str(argument) for argument in arguments])
        return (status, *capsys.readouterr())

    return call


@pytest.fixture
def on_bus(monkeypatch: pytest.MonkeyPatch) -> Callable[[ScriptedBus], None]:
    def use(scripted: ScriptedBus) -> None:
        monkeypatch.setattr(bus, "open_bus", lambda *_: scripted)

    return use


@pytest.fixture(params=[80, 120])
def columns(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    monkeypatch.setenv("COLUMNS", str(request.param))
    yield request.param


LOG = """\
# a limb of one
(0.000000) can0 100#0A T
(0.010000) can0 611#01020002000400 R
(0.010000) can0 311#8111020002000400 T
(0.030000) can0 011#0A R
"""


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "a.log"
    path.write_text(LOG)
    return path


# --- dump ----------------------------------------------------------------------------------------


def test_dump_of_a_log(pdcp: Pdcp, log: Path) -> None:
    assert pdcp("dump", log) == (
        0,
        "    0.000000  100  BA > all   Device Beacon\n"
        "    0.010000  611  11h > BA   Bind Device Request: requested=11h identity=2:2:4\n"
        "    0.010000  311  BA > 11h   Bind Device Response: node=11h (granted) identity=2:2:4\n"
        "    0.030000  011  11h > BA   Device Beacon\n",
        "",
    )


def test_dump_after_other_logs_is_the_reviewed_text(pdcp: Pdcp) -> None:
    learned = ["--learn", VECTORS / "setup_output.log", "--learn", VECTORS / "setup_input.log"]
    expected = (VECTORS / "link_made.txt").read_text()
    assert pdcp("dump", VECTORS / "link_made.log", *learned) == (0, expected, "")


@pytest.mark.parametrize("place", ["before", "behind"])
def test_dump_as_json_lines(pdcp: Pdcp, log: Path, place: str) -> None:
    words = ["--json", "dump", log] if place == "before" else ["dump", log, "--json"]
    status, out, _ = pdcp(*words)
    objects = [json.loads(line) for line in out.splitlines()]
    assert status == 0 and [each["meaning"] for each in objects] == [
        "Device Beacon", "Bind Device Request", "Bind Device Response", "Device Beacon",
    ]  # fmt: skip
    assert objects[2]["fields"] == {"node": 0x11, "identity": "2:2:4"}


def test_dump_of_standard_input(pdcp: Pdcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(LOG.encode())))
    assert len(pdcp("dump", "-")[1].splitlines()) == 4


def test_dump_of_a_bus(pdcp: Pdcp, on_bus: Callable[[ScriptedBus], None]) -> None:
    on_bus(ScriptedBus(message(1.5, 0x100, "0A"), message(2.0, 0x011, "0A")))
    text = "    1.500000  100  BA > all   Device Beacon\n    2.000000  011  11h > BA   Device Beacon [unknown id]\n"
    assert pdcp("dump", *BUS) == (0, text, "")


def test_bad_lines_are_told_and_the_rest_is_shown(pdcp: Pdcp, log: Path) -> None:
    log.write_text(LOG + "what is this\n(1.000000) can0 100#0A\n")
    status, out, errors = pdcp("dump", log)
    assert (status, len(out.splitlines())) == (1, 5)
    assert errors.splitlines() == [
        f"pdcp: {log}:6: not a line of candump -L, such as (1.000000) can0 123#11AA",
        "pdcp: 1 place could not be read",
    ]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["dump"], "give either a file or --interface"),
        (["dump", "a.log", *BUS], "give either a file or --interface"),
        (["dump", "a.log", "--seconds", "1"], "--seconds belongs to --interface"),
        (["dump", "missing.log"], "missing.log: No such file or directory"),
        (["dump", "missing.log", "--learn", "gone.log"], "gone.log: No such file or directory"),
        (["busload", "missing.log"], "missing.log: No such file or directory"),
        (["busload", "a.log", "--interval", "0"], "--interval"),
        (["replay", "missing.log", *BUS], "missing.log: No such file or directory"),
        (["record", "/nowhere/a.log", *BUS], "/nowhere/a.log: No such file or directory"),
        (["record", "a.log"], "--interface"),
        (["profiles", "emg.amplitud"], "perhaps emg.amplitude"),
        (["profiles", "3000h"], "3000h is not within the tree"),
    ],
)
def test_wrong_use_is_exit_2_with_one_line(pdcp: Pdcp, words: list[str], text: str) -> None:
    status, out, errors = pdcp(*words)
    assert (status, out, errors.count("\n")) == (2, "", 1)
    assert errors.startswith("pdcp: ") and text in errors


@pytest.mark.parametrize(
    "words", [["--interface", "nothing"], ["--interface", "socketcan", "--channel", "no-such-interface"]]
)
def test_a_bus_that_is_not_there_is_exit_3(pdcp: Pdcp, words: list[str]) -> None:
    status, out, errors = pdcp("dump", *words)
    assert (status, out, errors.count("\n")) == (3, "", 1)
    assert errors.startswith(f"pdcp: {words[1]}")


# --- busload -------------------------------------------------------------------------------------

# Bits of the four frames with interframe space: 58, 112, 120, 57.
TABLE = """\
Bus load at 1 Mbit/s

 sender      frames  bits  mean %  peak %
 ────────────────────────────────────────
 arbitrator       2   178    0.18    0.18
 2:2:4            2   169    0.17    0.17
 all              4   347    0.35    0.35

"""


def test_busload_of_a_log(pdcp: Pdcp, log: Path, columns: int) -> None:
    status, out, errors = pdcp("busload", log, "--interval", "0.1")
    assert (status, errors) == (0, "")
    assert "".join(f"{line.rstrip()}\n" for line in out.splitlines()) == TABLE
    assert max(len(line) for line in out.splitlines()) <= columns


def test_busload_as_json(pdcp: Pdcp, log: Path) -> None:
    status, out, _ = pdcp("busload", log, "--interval", "0.02", "--windows", "--json")
    data = json.loads(out)
    assert status == 0
    assert [row["sender"] for row in data["senders"]] == ["arbitrator", "2:2:4"]
    assert [window["start"] for window in data["windows"]] == [0.0, 0.02]
    assert [window["bits"] for window in data["windows"]] == [290, 57]
    assert data["windows"][0]["load"] == data["total"]["peak"] == pytest.approx(290 / 20_000)
    assert data["total"]["mean"] == pytest.approx(347 / 40_000)
    assert data["windows"][0]["senders"] == pytest.approx({"arbitrator": 178 / 20_000, "2:2:4": 112 / 20_000})
    assert data["uncounted"] == 0


def test_busload_of_a_bus_ends_with_ctrl_c(pdcp: Pdcp, on_bus: Callable[[ScriptedBus], None]) -> None:
    on_bus(ScriptedBus(message(0.0, 0x100, "0A"), message(0.5, 0x100, "0A")))
    status, out, _ = pdcp("busload", *BUS, "--json")
    assert (status, json.loads(out)["total"]["bits"]) == (0, 2 * 58)


def test_can_fd_frames_are_told(pdcp: Pdcp, log: Path) -> None:
    log.write_text("(0.000000) can0 123##01122\n")
    assert "CAN FD frames, not counted: 1" in pdcp("busload", log)[1]


# --- record and replay ---------------------------------------------------------------------------


def test_record_writes_what_candump_writes(pdcp: Pdcp, tmp_path: Path, on_bus: Callable[[ScriptedBus], None]) -> None:
    on_bus(ScriptedBus(message(1.5, 0x100, "0A"), message(2.25, 0x211, "8301")))
    path = tmp_path / "out.log"
    assert pdcp("record", path, *BUS) == (0, "", "2 frames\n")
    assert path.read_text() == "(1.500000) x 100#0A R\n(2.250000) x 211#8301 R\n"


def test_record_names_the_bus_of_socketcand(pdcp: Pdcp, on_bus: Callable[[ScriptedBus], None]) -> None:
    on_bus(ScriptedBus(message(1.0, 0x100, "0A")))
    status, out, _ = pdcp("record", "-", "-i", "socketcand", "-c", "127.0.0.1:28600/limb")
    assert (status, out) == (0, "(1.000000) limb 100#0A R\n")


def test_replay_sends_all_frames(pdcp: Pdcp, log: Path, on_bus: Callable[[ScriptedBus], None]) -> None:
    scripted = ScriptedBus()
    scripted.full = 2
    on_bus(scripted)
    assert pdcp("replay", log, *BUS, "--no-wait") == (0, "", "4 frames\n")
    assert [(each.arbitration_id, bytes(each.data).hex()) for each in scripted.sent] == [
        (0x100, "0a"), (0x611, "01020002000400"), (0x311, "8111020002000400"), (0x011, "0a"),
    ]  # fmt: skip


def test_replay_passes_error_frames_over(pdcp: Pdcp, log: Path, on_bus: Callable[[ScriptedBus], None]) -> None:
    scripted = ScriptedBus()
    on_bus(scripted)
    log.write_text("(1.000000) can0 20000004#0000000000000000\n(2.000000) can0 123#R\n")
    status, _, errors = pdcp("replay", log, *BUS, "--no-wait")
    assert status == 1 and f"{log}: the error frame at 1.000000 s cannot be sent" in errors
    assert [(each.arbitration_id, each.is_remote_frame) for each in scripted.sent] == [(0x123, True)]


def test_a_recorded_log_is_replayed_as_it_was(
    pdcp: Pdcp, tmp_path: Path, on_bus: Callable[[ScriptedBus], None]
) -> None:
    messages = [message(1.0, 0x100, "0A"), message(1.001, 0x0FE, "0102030405060708")]
    on_bus(ScriptedBus(*messages))
    path = tmp_path / "a.log"
    pdcp("record", path, *BUS)
    scripted = ScriptedBus()
    on_bus(scripted)
    pdcp("replay", path, *BUS, "--speed", "10")
    assert [(each.arbitration_id, each.data) for each in scripted.sent] == [
        (each.arbitration_id, each.data) for each in messages
    ]


# --- profiles ------------------------------------------------------------------------------------


def test_profiles_fit_the_terminal(pdcp: Pdcp, columns: int) -> None:
    status, out, _ = pdcp("profiles")
    assert status == 0 and max(len(line) for line in out.splitlines()) <= columns
    assert "2220h  emg.amplitude " in out


def test_what_a_profile_requires(pdcp: Pdcp, columns: int) -> None:
    status, out, _ = pdcp("profiles", "2221h")
    assert status == 0 and max(len(line) for line in out.splitlines()) <= columns
    assert "2221h EMG amplitude > 2221h" in out and "20 to 200" in out
    assert json.loads(pdcp("profiles", "2221h", "--json")[1])["path"] == "emg.amplitude"
    assert len(json.loads(pdcp("profiles", "--json")[1])) == 106


def test_nobody_serves_the_bus(pdcp: Pdcp) -> None:
    """The system's reason in words, without its number."""
    status, _, error = pdcp("dump", "-i", "socketcand", "-c", "127.0.0.1:1/limb")
    assert (status, error) == (3, "pdcp: socketcand 127.0.0.1:1/limb: Connection refused\n")
