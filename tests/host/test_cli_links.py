"""Help and version, and the commands on stored configurations against a scripted arbitrator."""

import json
from collections.abc import Callable

import pytest
import typer
import typer.main
from scripted import Script, ScriptedArbitrator
from typer.core import TyperGroup

import pdcp
from pdcp.cli import app
from pdcp.cli.common import PROGRAM_OPTIONS, run
from pdcp.wire import Frame

INFO = bytes((1, 0, 1, 0, 64, 0xFF, 0x80, 2, 3, 2, 0))  # configuration 3 is active, two are stored


def configurations(frame: Frame) -> list[Frame]:
    """Has 7 links to change, whatever it is told."""
    payload = {0x2401: INFO, 0x2407: b"\x07\x00"}[frame.message]
    return [Frame(frame.message + 1, frame.reference, payload)]


# D-PRO-16: 0 is the active configuration.
ACTIONS = [
    (["save"], "01 00", "saved"),
    (["save", "9", "--yes"], "01 09", "saved"),
    (["load"], "02 00", "loaded, 7 links changed"),
    (["load", "0"], "02 00", "loaded, 7 links changed"),
    (["load", "9"], "02 09", "loaded, 7 links changed"),
    (["erase", "--yes"], "03 00", "erased"),
    (["erase", "255", "--yes"], "03 FF", "erased"),
]


@pytest.mark.parametrize(("words", "payload", "done"), ACTIONS)
def test_a_configuration_is_named_by_its_number_or_is_the_active_one(
    arbitrator: Callable[[Script], ScriptedArbitrator],
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    payload: str,
    done: str,
) -> None:
    peer = arbitrator(configurations)
    assert run(app, ["--port", peer.port, *words]) == 0
    assert capsys.readouterr().out == f"{done}; configuration 3 is active, 2 stored\n"
    assert [(each.message, each.payload) for each in peer.requests] == [(0x2407, bytes.fromhex(payload)), (0x2401, b"")]


def test_what_is_no_number_of_a_configuration(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("save", "load", "erase"):
        for number in ("256", "-1", "one"):
            assert run(app, [command, number]) == 2
            assert capsys.readouterr().out == ""


def test_version_as_option_and_as_command(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["--version"], ["version"]):
        assert run(app, words) == 0
        assert capsys.readouterr().out == f"pdcp {pdcp.__version__}\n"
    assert run(app, ["--json", "version"]) == 0
    assert json.loads(capsys.readouterr().out)["pdcp"] == pdcp.__version__


@pytest.mark.parametrize("command", [[], ["load"], ["watch"], ["config"], ["config", "decode"]])
def test_help_shows_no_type_of_what_takes_no_value(capsys: pytest.CaptureFixture[str], command: list[str]) -> None:
    assert run(app, [*command, "--help"]) == 0
    out = capsys.readouterr().out
    assert "--help" in out and "bool" not in out


@pytest.mark.parametrize("where", [0, 1, 2])
@pytest.mark.parametrize("form", ["--port {}", "-p {}", "--port={}"])
def test_the_port_may_stand_anywhere(
    arbitrator: Callable[[Script], ScriptedArbitrator], capsys: pytest.CaptureFixture[str], where: int, form: str
) -> None:
    peer = arbitrator(configurations)
    words = ["load", "9"]
    words[where:where] = form.format(peer.port).split()
    assert run(app, words) == 0
    assert capsys.readouterr().out.startswith("loaded")


def test_behind_two_dashes_are_values(
    arbitrator: Callable[[Script], ScriptedArbitrator], capsys: pytest.CaptureFixture[str]
) -> None:
    peer = arbitrator(configurations)
    assert run(app, ["-p", peer.port, "load", "--", "--port"]) == 2
    assert "'N'" in capsys.readouterr().err and peer.requests == []
    assert run(app, ["load", "9", "--port"]) == 2
    assert capsys.readouterr().err == "pdcp: --port needs a value\n"


def test_no_command_has_an_option_of_the_program() -> None:
    program = typer.main.get_command(app)
    assert isinstance(program, TyperGroup)
    commands = list(program.commands.values())
    for command in commands:
        if isinstance(command, TyperGroup):
            commands += command.commands.values()
        names = {name for option in command.params for name in option.opts}
        assert not names & set(PROGRAM_OPTIONS), command.name


@pytest.mark.parametrize("command", [[], ["load"], ["config"], ["config", "decode"]])
def test_help_has_a_short_name(capsys: pytest.CaptureFixture[str], command: list[str]) -> None:
    assert run(app, [*command, "-h"]) == 0
    assert "Usage: pdcp" in capsys.readouterr().out
