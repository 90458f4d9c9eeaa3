"""tools/demo: what it shows, what it accepts as good, and that nothing stays behind."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from demo_limb import Sine, check_values
from programs import Value, until

from pdcp import Identity

ROOT = Path(__file__).resolve().parents[2]
SINE = Sine(0, 255, 2000, 20)
HAND = Identity(2, 2, 6)
END_TIMEOUT_S = 60  # only a program that hangs takes as long

Demo = Callable[..., subprocess.Popen[str]]


def child(pid: int, name: str) -> int:
    """The running program of this name that the demonstration has started."""
    for each in children(pid):
        with suppress(FileNotFoundError):
            if Path(f"/proc/{each}/comm").read_text(encoding="ascii").strip() == name:
                return each
    pytest.fail(f"there is no {name}")


def children(pid: int) -> list[int]:
    found = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    return [int(each) for each in found]


def is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state.rpartition(")")[2].split()[0] != "Z"


@pytest.fixture
def demo(programs: Path) -> Iterator[Demo]:
    """demo(ARGUMENT...): the demonstration, running, its output not a terminal."""
    started: list[subprocess.Popen[str]] = []

    def start_demo(*arguments: str | Path) -> subprocess.Popen[str]:
        command = [sys.executable, "-u", ROOT / "tools/demo_limb.py", "--bin", programs, *arguments]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        started.append(process)
        return process

    yield start_demo
    for process in started:
        process.kill()
        process.communicate()


def line_with(process: subprocess.Popen[str], part: str) -> str:
    assert process.stdout is not None
    for line in process.stdout:
        if part in line:
            return line
    pytest.fail(f"'{part}' was not printed")


def test_once(demo: Demo) -> None:
    process = demo("--once")
    output, errors = process.communicate(timeout=END_TIMEOUT_S)
    assert (process.returncode, errors) == (0, "")
    for words in (
        "D1 sensor 2:2:4",
        "D1 sensor, 1 signal 2120h → D2 controller, 2 muscle 2110h active",
        "D2 controller, 3 wrist 1100h → D3 hand, 1 wrist motor 1110h active",
        "D2 controller, 5 grip 1220h → D3 hand, 2 grip motor 1220h active",
        "it is missed: the hand goes to its safe values",
        "its values arrive at the hand; nobody asked for it",
        "D4 sensor, 1 signal 2122h → D2 controller, 2 muscle 2110h active",
        "The limb has repaired itself.",
    ):
        assert words in " ".join(output.split())
    assert max(len(line) for line in output.splitlines()) <= 80
    assert "\x1b" not in output


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 0), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_signal_ends_all(number: signal.Signals, status: int, demo: Demo) -> None:
    process = demo()
    line_with(process, "wrist motor ")
    line_with(process, " s   wrist motor")
    started = children(process.pid)
    process.send_signal(number)
    _, errors = process.communicate(timeout=END_TIMEOUT_S)
    assert (process.returncode, errors) == (status, "")
    assert not any(is_alive(pid) for pid in started)


def test_not_even_a_killed_demonstration_leaves_anything_behind(demo: Demo) -> None:
    process = demo()
    line_with(process, " s   wrist motor")
    started = children(process.pid)
    process.kill()
    until(lambda: not any(is_alive(pid) for pid in started), "pdcpd and the sensor have ended")


def test_a_reader_that_goes(demo: Demo) -> None:
    """As with `tools/demo | head`."""
    process = demo()
    line_with(process, " s   wrist motor")
    started = children(process.pid)
    assert process.stdout is not None
    process.stdout.close()
    assert process.wait(END_TIMEOUT_S) != 0
    assert process.stderr is not None
    assert process.stderr.read() == ""
    assert not any(is_alive(pid) for pid in started)


@pytest.mark.parametrize("when", ["Devices", " s   wrist motor"])
def test_pdcpd_dies(when: str, demo: Demo) -> None:
    process = demo("--once")
    line_with(process, when)
    pdcpd = child(process.pid, "pdcpd")
    os.kill(pdcpd, signal.SIGKILL)
    _, errors = process.communicate(timeout=END_TIMEOUT_S)
    assert process.returncode == 1
    assert errors == "demo: pdcpd ended early (signal SIGKILL)\n"


def test_pdcpd_does_not_start(demo: Demo, tmp_path: Path) -> None:
    """What it complains about is passed on."""
    fake = tmp_path / "pdcpd"
    fake.write_text("#!/bin/sh\necho 'pdcpd: no' >&2\nexit 2\n", encoding="ascii")
    fake.chmod(0o755)
    process = demo("--bin", tmp_path)
    output, errors = process.communicate(timeout=END_TIMEOUT_S)
    assert (process.returncode, output, errors) == (1, "", "demo: pdcpd ended early (exit status 2)\npdcpd: no\n")


@pytest.mark.parametrize("script", ["demo", "demo_limb.py"])
@pytest.mark.parametrize("argument", ["--nonsense", "nonsense"])
def test_wrong_arguments(script: str, argument: str) -> None:
    command = [sys.executable] if script.endswith(".py") else []
    words: list[str | Path] = [*command, ROOT / "tools" / script, argument]
    result = subprocess.run(words, capture_output=True, text=True, timeout=END_TIMEOUT_S, check=False)
    assert (result.returncode, result.stdout) == (2, "")
    assert len(result.stderr.splitlines()) == 1
    assert argument in result.stderr


# --- what --once takes for D1's sine ---


def good_values(shift_ms: int = 777) -> list[Value]:
    """100 samples, 2 s, at both inputs; the grip is the upper half of the range."""
    values = []
    for time_ms in range(5000, 7000, 20):
        wrist = round(SINE.at(time_ms + shift_ms))
        values.append(Value(time_ms, HAND, 1, wrist, False))
        values.append(Value(time_ms, HAND, 2, int(wrist >= 128), False))
    return values


def changed(channel: int, change: Callable[[Value], int | None]) -> list[Value]:
    return [each._replace(value=change(each)) if each.channel == channel else each for each in good_values()]


@pytest.mark.parametrize("shift_ms", [0, 1, 500, 777, 1999])
def test_the_sine_is_good(shift_ms: int) -> None:
    assert check_values(SINE, good_values(shift_ms)) == ""


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        ([], "only 0 of"),
        ([each for each in good_values() if each.channel == 1], "at the grip"),
        ([each for each in good_values() if each.channel == 2], "at the wrist"),
        (good_values()[:100], "only 50 of"),
        (changed(1, lambda _: 128), "same value"),
        (changed(2, lambda _: 1), "same value"),
        (changed(1, lambda each: 300 if each.value == 0 else each.value), "not between"),
        (changed(1, lambda _: None), "same value"),
        (changed(1, lambda each: 255 - (each.value or 0) if each.time_ms < 6000 else each.value), "not those"),
        (changed(1, lambda each: each.time_ms // 20 % 2 * 255), "not those"),
        (changed(1, lambda each: each.time_ms * 7919 % 256), "not those"),
        (changed(1, lambda each: each.time_ms // 8 % 256), "not those"),
        (changed(1, lambda each: (each.value or 0) // 2), "not those"),
        (changed(2, lambda each: 1 - (each.value or 0)), "not those"),
        (changed(2, lambda each: each.time_ms // 20 % 2), "not those"),
        ([each._replace(safe=each.time_ms == 6000) for each in good_values()], "safe"),
    ],
)
def test_anything_else_is_not(values: list[Value], fault: str) -> None:
    assert fault in check_values(SINE, values)
