"""What loses something asks first on a terminal, wants an option elsewhere, and shows itself in a dry run."""

import json
import os
import pty
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from scripted import Script, ScriptedArbitrator

from pdcp.cli import app
from pdcp.cli.common import run
from pdcp.wire import Frame

COMMAND = Path(sys.executable).with_name("pdcp")
TIMEOUT_S = 60.0  # only a command that hangs takes as long

NO_CONFIGURATIONS = bytes((1, 0, 0, 15, 0, 0))
CONFIGURATIONS = bytes((1, 2, 0, 2, 1, 0, 3, 0, 0, 2, 3, 0, 3, 0, 0, 15, 0, 0))  # 1 and 3, without links
INFO = bytes((1, 0, 1, 0, 64, 0xFF, 0x80, 2, 3, 2, 0))  # configuration 3 is active, two are stored
DEVICES = [bytes((2, 0, 2, 0, serial, 0, 0, 0, 0, 0, 0)) for serial in (4, 5)]  # 2:2:4 and 2:2:5
CHANGES = {0x2407, 0x240D, 0x230A, 0x230D}  # actions, configurations, frames to devices, resets

Arbitrator = Callable[[Script], ScriptedArbitrator]


def limb(frame: Frame) -> list[Frame]:
    """Two devices, four links, two configurations; says yes to all that it is told."""
    number = frame.payload[0] if frame.payload else 0
    if frame.message == 0x2204 and number > len(DEVICES):
        return [Frame(0x2206, frame.reference, b"\x02")]
    answers = {
        0x2201: bytes((2, 3, 3, 4)),
        0x2204: DEVICES[(number - 1) % 2],
        0x2401: INFO,
        0x2407: b"\x04\x00",
        0x240A: bytes((len(CONFIGURATIONS), 0, 0, 0)) + CONFIGURATIONS,
        0x240D: b"",
    }
    return [Frame(frame.message + 1, frame.reference, answers[frame.message])]


@pytest.fixture
def yaml(tmp_path: Path) -> Path:
    path = tmp_path / "limb.yaml"
    path.write_text("configurations: []\n", encoding="utf-8")
    return path


def at_a_terminal(arbitrator: ScriptedArbitrator, answer: str, *words: str | Path) -> tuple[int, str]:
    """pdcp with a terminal, at which somebody answers: exit status, and what stands there."""
    ours, theirs = pty.openpty()
    try:
        os.write(ours, answer.encode())
        process = subprocess.run(
            [COMMAND, "--port", arbitrator.port, *words],
            stdin=theirs,
            stdout=subprocess.DEVNULL,
            stderr=theirs,
            check=False,
            timeout=TIMEOUT_S,
        )
        return process.returncode, os.read(ours, 65536).decode()
    finally:
        os.close(ours)
        os.close(theirs)


def changes(arbitrator: ScriptedArbitrator) -> list[int]:
    return [each.message for each in arbitrator.requests if each.message in CHANGES]


ORDERS = [
    (["clear"], "remove 4 links", "--yes", 0x2407),
    (["erase"], "erase configuration 3", "--yes", 0x2407),
    (["erase", "1"], "erase configuration 1", "--yes", 0x2407),
    (["save", "1"], "overwrite configuration 1", "--yes", 0x2407),
    (["config", "import", "YAML"], "store 0 configurations in place of 2", "--yes", 0x240D),
]
NAMES = [" ".join(words) for words, *_ in ORDERS]


def filled(words: list[str], yaml: Path) -> list[str]:
    return [str(yaml) if word == "YAML" else word for word in words]


@pytest.mark.parametrize(("words", "loss", "option", "message"), ORDERS, ids=NAMES)
def test_it_asks_at_a_terminal(
    arbitrator: Arbitrator, yaml: Path, words: list[str], loss: str, option: str, message: int
) -> None:
    for answer, status, told in (("n\n", 1, []), ("\n", 1, []), ("y\n", 0, [message])):
        peer = arbitrator(limb)
        done, text = at_a_terminal(peer, answer, *filled(words, yaml))
        assert f"This will {loss}. Go on? [y/N]" in text
        assert ("nothing was changed" in text) == (status == 1)
        assert (done, changes(peer)) == (status, told)


@pytest.mark.parametrize(("words", "loss", "option", "message"), ORDERS, ids=NAMES)
def test_it_wants_an_option_where_nobody_can_answer(
    arbitrator: Arbitrator,
    capsys: pytest.CaptureFixture[str],
    yaml: Path,
    words: list[str],
    loss: str,
    option: str,
    message: int,
) -> None:
    peer = arbitrator(limb)
    assert run(app, ["--port", peer.port, *filled(words, yaml)]) == 2
    assert f"this would {loss}: give {option} if" in capsys.readouterr().err
    assert changes(peer) == []
    assert run(app, ["--port", peer.port, *filled(words, yaml), option]) == 0
    assert changes(peer) == [message]


@pytest.mark.parametrize("words", [["clear"], ["erase"], ["config", "import", "YAML"], ["suspend"], ["reset", "2:2:4"]])
def test_a_dry_run_does_nothing(
    arbitrator: Arbitrator, capsys: pytest.CaptureFixture[str], yaml: Path, words: list[str]
) -> None:
    peer = arbitrator(limb)
    assert run(app, ["--port", peer.port, *filled(words, yaml), "--dry-run"]) == 0
    assert capsys.readouterr().out.startswith("would ")
    assert run(app, ["--port", peer.port, *filled(words, yaml), "--dry-run", "--json"]) == 0
    assert list(json.loads(capsys.readouterr().out)) == ["would"]
    assert changes(peer) == []


@pytest.mark.parametrize("verb", ["suspend", "reset"])
def test_all_devices_are_meant_only_if_said_so(
    arbitrator: Arbitrator, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    peer = arbitrator(limb)
    assert run(app, ["--port", peer.port, verb]) == 2
    assert f"this would {verb} all 2 devices" in capsys.readouterr().err
    assert run(app, ["--port", peer.port, verb, "2:2:4", "--all"]) == 2
    assert "give devices or --all, not both" in capsys.readouterr().err
    status, text = at_a_terminal(peer, "n\n", verb)
    assert status == 1 and f"This will {verb} all 2 devices" in text
    assert changes(peer) == []


def test_nothing_is_asked_where_nothing_is_lost(arbitrator: Arbitrator, capsys: pytest.CaptureFixture[str]) -> None:
    peer = arbitrator(limb)
    for words in (["save"], ["save", "3"], ["save", "2"]):  # the active one, and one that is not stored
        assert run(app, ["--port", peer.port, *words]) == 0
    assert len(changes(peer)) == 3
    assert run(app, ["--port", peer.port, "erase", "2"]) == 1
    assert "there is no configuration 2" in capsys.readouterr().err


def test_a_file_is_overwritten_only_by_force(
    arbitrator: Arbitrator, capsys: pytest.CaptureFixture[str], yaml: Path, tmp_path: Path
) -> None:
    peer = arbitrator(limb)
    log = tmp_path / "limb.log"
    log.write_text("precious", encoding="utf-8")
    commands = [
        (["config", "export", str(yaml)], yaml),
        (["config", "encode", str(yaml), str(log)], log),
        (["record", str(log), "-i", "virtual", "--seconds", "0.01"], log),
    ]
    for words, file in commands:
        before = file.read_bytes()
        assert run(app, ["--port", peer.port, *words]) == 2
        assert f"this would overwrite {file}: give --force" in capsys.readouterr().err
        assert file.read_bytes() == before
        assert run(app, ["--port", peer.port, *words, "--force"]) == 0
        assert file.read_bytes() != before
        log.write_text("precious", encoding="utf-8")
