"""Programs whose lines nobody reads: pipes that are full, terminals that are stopped, disks that are full.

The limb goes on (D-LIN-6)."""

import os
import pty
import subprocess
import termios
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest
from programs import END_TIMEOUT_S, Pdcpd, Program, until

from pdcp import ChannelId, Client, Identity, LinkStatus

D1, D2, D3 = (Identity(2, 2, serial) for serial in (4, 5, 6))
LINKS = [
    (ChannelId(D1, 1), ChannelId(D2, 2)),
    (ChannelId(D2, 3), ChannelId(D3, 1)),
    (ChannelId(D2, 5), ChannelId(D3, 2)),
]
FRAMES = 7000  # a third are values of D1, and D3 prints the others: more lines than a pipe and the buffer hold

Run = Callable[[list[str | Path]], "subprocess.Popen[bytes]"]


@pytest.fixture
def fast(files: dict[str, Path]) -> dict[str, Path]:
    """The three parts, of which the sensor sends a thousand values a second."""
    text = files["d1"].read_text(encoding="utf-8")
    assert "rate_ms = 20\n" in text
    files["d1"].write_text(text.replace("rate_ms = 20\n", "rate_ms = 1\n"), encoding="utf-8")
    return files


@pytest.fixture(params=["pipe", "stopped terminal", "full disk"])
def unread(request: pytest.FixtureRequest, stack: ExitStack) -> int:
    """A descriptor to which lines can be written, and nobody reads them."""
    if request.param == "full disk":
        end = os.open("/dev/full", os.O_WRONLY)
    else:
        other, end = os.pipe() if request.param == "pipe" else pty.openpty()
        stack.callback(os.close, other)
    if request.param == "stopped terminal":
        termios.tcflow(end, termios.TCOOFF)  # what Ctrl-S does
    stack.callback(os.close, end)
    return end


@pytest.fixture
def run(stack: ExitStack, unread: int) -> Run:
    """run(WORDS): a program whose lines nobody reads."""

    def start_program(words: list[str | Path]) -> "subprocess.Popen[bytes]":
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=unread, stderr=unread)
        stack.callback(process.kill)
        return process

    return start_program


def assert_goes_on(host: Client, process: "subprocess.Popen[bytes]") -> None:
    """More values than anybody holds flow, nobody is lost, and the program ends when it is told to."""
    before = host.stats(0)["channel_data"]
    until(lambda: host.stats(0)["channel_data"] - before > FRAMES, "values flow")
    assert host.stats(0)["lost"] == 0
    assert [link.status for link in host.links()] == [LinkStatus.ACTIVE] * len(LINKS)
    process.terminate()
    assert process.wait(END_TIMEOUT_S) == 0


def link_all(host: Client) -> None:
    until(lambda: host.system_info()[:3] == (3, 4, 4), "all parts are there")
    for output, input_ in LINKS:
        assert host.link(output, input_) == LinkStatus.ACTIVE


def test_a_daemon_goes_on(programs: Path, fast: dict[str, Path], tmp_path: Path, run: Run) -> None:
    """It prints each value of its own parts, and what happens on the bus."""
    link = tmp_path / "host"
    words: list[str | Path] = [programs / "pdcpd", "--can", "sim", "--host", f"pty:{link}", "--log", "debug"]
    words += ["--no-autoconfig"]
    for path in fast.values():
        words += ["--node", path]
    process = run(words)
    until(link.exists, "the host's port is there")
    with Client(str(link)) as host:
        link_all(host)
        assert_goes_on(host, process)


def test_a_node_goes_on(
    programs: Path,
    start: Callable[..., Pdcpd],
    start_node: Callable[..., Program],
    fast: dict[str, Path],
    run: Run,
) -> None:
    """A hand whose values nobody reads stays on the bus."""
    pdcpd = start("--can", "sim:0")
    start_node(pdcpd, fast["d1"], fast["d2"])
    process = run([programs / "pdcp-node", "--can", f"socketcand:127.0.0.1:{pdcpd.bus_port()}/any", fast["d3"]])
    with Client(pdcpd.port()) as host:
        link_all(host)
        assert_goes_on(host, process)
