"""pdcpd and pdcp-node as programs: how they begin, complain and end."""

import re
import signal
import socket
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from programs import END_TIMEOUT_S, Pdcpd, until
from rawhost import RawHost

from pdcp import Action, ChannelId, Client, ConnectionFailedError, Identity, Link, LinkStatus, RequestError

Start = Callable[..., Pdcpd]
Connect = Callable[[Pdcpd], RawHost]
Run = Callable[..., tuple[int, list[str]]]

NVM_SIZE = 32768


@pytest.fixture
def run(programs: Path) -> Run:
    """run(PROGRAM, ARGUMENT...): exit status and the lines of standard error of a program that ends by itself."""

    def run_program(name: str, *arguments: str | Path) -> tuple[int, list[str]]:
        words = [programs / name, *arguments]
        result = subprocess.run(
            words, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=END_TIMEOUT_S, check=False
        )
        assert result.stdout == ""
        return result.returncode, result.stderr.splitlines()

    return run_program


def assert_one_line(result: tuple[int, list[str]], *parts: str, expected: int = 2) -> None:
    """This exit status, and one line that has all the parts."""
    status, lines = result
    assert status == expected, lines
    assert len(lines) == 1, lines
    assert "/bin/" not in lines[0], "programs are told by their names"
    for part in parts:
        assert part in lines[0]


# --- wrong use ---


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["--host", "pty"], ["--can"]),
        (["--can", "sim"], ["--host"]),
        (["--can", "sim", "--host", "pty", "--nonsense"], ["--nonsense"]),
        (["--can", "sim", "--host", "pty", "-x"], ["x"]),
        (["--can", "sim", "--host", "pty", "--can"], ["--can"]),
        (["--can", "sim", "--host", "pty", "nonsense"], ["nonsense"]),
        (["--can", "sim", "--host", "pty", "--log", "loud"], ["loud"]),
        (["--can", "nonsense", "--host", "pty"], ["nonsense"]),
        (["--can", "sim:x", "--host", "pty"], ["sim:x"]),
        (["--can", "sim:65536", "--host", "pty"], ["65536"]),
        (["--can", "sim:", "--host", "pty"], ["sim:"]),
        (["--can", "sim", "--host", "nonsense"], ["nonsense"]),
        (["--can", "sim", "--host", "serial:/dev/nosuch@x"], ["baud rate"]),
        (["--can", "socketcand:127.0.0.1", "--host", "pty"], ["127.0.0.1"]),
        (["--can", "sim", "--host", "pty", "--node", "/nosuch.ini"], ["/nosuch.ini"]),
        (["--can", "socketcan:nosuch0", "--host", "pty", "--node", "d1.ini"], ["--node", "sim"]),
        (["--can", "sim", "--host", "pty", "--nvm", "/nosuch/file"], ["/nosuch/file"]),
        (["--can", "sim", "--host", "pty", "--config", "/nosuch.ini"], ["/nosuch.ini"]),
    ],
)
def test_pdcpd_wrong_use(arguments: list[str], parts: list[str], run: Run) -> None:
    assert_one_line(run("pdcpd", *arguments), "pdcpd: ", *parts)


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["--can", "sim", "--host", "pty:/nosuch/folder/link"], ["/nosuch/folder/link"]),
        (["--can", "sim", "--host", "serial:/dev/nosuch"], ["/dev/nosuch"]),
        (["--can", "socketcan:nosuch0", "--host", "pty"], ["nosuch0"]),
        (["--can", "socketcand:127.0.0.1:1/can0", "--host", "pty"], ["127.0.0.1:1"]),
        (["--can", "gs_usb:no-such-serial", "--host", "pty"], ["no-such-serial"]),
    ],
)
def test_pdcpd_misses_something(arguments: list[str], parts: list[str], run: Run) -> None:
    """What may be there later: a service manager tries again."""
    assert_one_line(run("pdcpd", *arguments), "pdcpd: ", *parts, expected=3)


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["/nosuch.ini"], ["--can"]),
        (["--can", "socketcan:nosuch0"], ["FILE"]),
        (["--can", "socketcan:nosuch0", "/nosuch.ini"], ["/nosuch.ini"]),
        (["--can", "sim", "D1"], ["D1"]),
        (["--nonsense"], ["--nonsense"]),
    ],
)
def test_pdcp_node_wrong_use(arguments: list[str], parts: list[str], run: Run) -> None:
    assert_one_line(run("pdcp-node", *arguments), "pdcp-node: ", *parts)


@pytest.mark.parametrize("program", ["pdcpd", "pdcp-node"])
def test_version(program: str, programs: Path) -> None:
    result = subprocess.run([programs / program, "--version"], capture_output=True, text=True, timeout=END_TIMEOUT_S)
    assert result.returncode == 0
    assert re.fullmatch(rf"{program} \d+\.\d+\.\d+\n", result.stdout)


def test_missing_interface(run: Run, files: dict[str, Path]) -> None:
    """In an environment without CAN the line says so."""
    status, lines = run("pdcp-node", "--can", "socketcan:nosuch0", files["d1"])
    assert_one_line((status, lines), "socketcan:nosuch0", expected=3)
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError:
        assert "kernel" in lines[0] or "CAN" in lines[0].replace("socketcan", "")


def test_a_bad_description(run: Run, tmp_path: Path) -> None:
    """The line names file and line."""
    bad = tmp_path / "bad.ini"
    bad.write_text("[device]\nvid = 2\npid = two\n", encoding="utf-8")
    assert_one_line(run("pdcpd", "--can", "sim", "--host", "pty", "--node", bad), f"{bad}:3: ")


def test_an_occupied_tcp_port(run: Run) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        assert_one_line(run("pdcpd", "--can", f"sim:{port}", "--host", "pty"), str(port), expected=3)


def test_a_regular_file_is_no_link(run: Run, tmp_path: Path) -> None:
    """It is refused, and left alone."""
    file = tmp_path / "precious"
    file.write_text("precious", encoding="utf-8")
    assert_one_line(run("pdcpd", "--can", "sim", "--host", f"pty:{file}"), str(file), expected=3)
    assert file.read_text(encoding="utf-8") == "precious"


@pytest.mark.parametrize("size", [1, NVM_SIZE - 1, NVM_SIZE + 1, 100000])
def test_nvm_of_another_size(size: int, run: Run, tmp_path: Path) -> None:
    """It is refused, and left alone."""
    nvm = tmp_path / "nvm"
    nvm.write_bytes(b"\x55" * size)
    assert_one_line(run("pdcpd", "--can", "sim", "--host", "pty", "--nvm", nvm), str(nvm))
    assert nvm.read_bytes() == b"\x55" * size


def test_nvm_is_a_folder(run: Run, tmp_path: Path) -> None:
    assert_one_line(run("pdcpd", "--can", "sim", "--host", "pty", "--nvm", tmp_path), str(tmp_path))


def test_nvm_in_use(start: Start, run: Run, tmp_path: Path) -> None:
    nvm = tmp_path / "nvm"
    pdcpd = start("--nvm", nvm)
    pdcpd.port()
    assert_one_line(run("pdcpd", "--can", "sim", "--host", "pty", "--nvm", nvm), str(nvm), "in use")
    assert not pdcpd.has_ended()


# --- the end ---


def test_sigterm(limb: Start, tmp_path: Path) -> None:
    link = tmp_path / "arbitrator"
    pdcpd = limb("--host", f"pty:{link}")
    path = pdcpd.port()
    assert str(link.readlink()) == path
    assert pdcpd.stop() == 0
    assert not link.is_symlink()


def test_sigterm_of_a_device(start: Start, start_node: Start, files: dict[str, Path]) -> None:
    pdcpd = start("--can", "sim:0")
    node = start_node(pdcpd, files["d1"])
    until(lambda: any("2:2:4 (id" in line for line in pdcpd.errors), "the device is there")
    assert node.stop() == 0
    assert node.errors == []


def test_a_stale_link_is_replaced(start: Start, tmp_path: Path) -> None:
    link = tmp_path / "arbitrator"
    pdcpd = start("--host", f"pty:{link}")
    pdcpd.port()
    pdcpd.kill()
    assert link.is_symlink()
    path = start("--host", f"pty:{link}").port()
    assert str(link.readlink()) == path
    with Client(str(link)) as host:
        assert host.system_info() == (0, 0, 0, 0)


def test_a_link_that_a_crash_has_left_leads_to_nobody_else(start: Start, tmp_path: Path) -> None:
    """D-LIN-4: the number of its terminal may be another daemon's by now. A command for one limb must not reach
    another."""
    left, right = tmp_path / "left", tmp_path / "right"
    crashed = start("--host", f"pty:{left}")
    crashed.port()
    crashed.kill()
    other = start("--host", f"pty:{right}")
    left.unlink()
    left.symlink_to(other.port())  # as it is when the number is taken again
    with pytest.raises(ConnectionFailedError, match=f"{left}: its daemon has ended"):
        Client(str(left))
    with Client(str(right)) as host:
        assert host.system_info() == (0, 0, 0, 0)
    path = start("--host", f"pty:{left}").port()
    assert str(left.readlink()) == path
    with Client(str(left)) as host:
        assert host.system_info() == (0, 0, 0, 0)


def test_a_terminal_that_closes_ends_the_daemon(start: Start, tmp_path: Path) -> None:
    """SIGHUP is a clean end: nothing is left behind."""
    link = tmp_path / "arbitrator"
    pdcpd = start("--host", f"pty:{link}")
    pdcpd.port()
    pdcpd.process.send_signal(signal.SIGHUP)
    assert pdcpd.wait() == 0
    assert list(tmp_path.glob("arbitrator*")) == []


def test_two_with_the_same_link(start: Start, run: Run, tmp_path: Path) -> None:
    """The later one is refused, and the earlier one keeps its link."""
    link = tmp_path / "arbitrator"
    first = start("--host", f"pty:{link}")
    path = first.port()
    assert_one_line(run("pdcpd", "--can", "sim", "--host", f"pty:{link}"), str(link), "in use", expected=3)
    assert str(link.readlink()) == path
    with Client(str(link)) as host:
        assert host.system_info() == (0, 0, 0, 0)
    assert first.stop() == 0
    assert not link.is_symlink()


def test_tcp_port_is_free_at_once_after_the_end(start: Start, start_node: Start, files: dict[str, Path]) -> None:
    """The listening socket is reusable at once after a restart, although a connection was open."""
    pdcpd = start("--can", "sim:0")
    port = pdcpd.bus_port()
    start_node(pdcpd, files["d1"])
    until(lambda: any("2:2:4 (id" in line for line in pdcpd.errors), "the device is there")
    assert pdcpd.stop() == 0
    assert start("--can", f"sim:{port}").bus_port() == port


# --- what they read ---


def test_configuration_file(start: Start, connect: Connect, files: dict[str, Path], tmp_path: Path) -> None:
    """Section [pdcpd]; the command line adds to it."""
    link = tmp_path / "arbitrator"
    config = tmp_path / "pdcpd.ini"
    config.write_text(f"[pdcpd]\nnode = {files['d1']}\nstrict-crc = yes\n", encoding="utf-8")
    host = connect(start("--config", config, "--host", f"pty:{link}", "--node", files["d3"]))
    until(lambda: host.system_info()[:3] == (2, 2, 1), "both devices are set up")
    host.send_bytes(bytes.fromhex("FE 19 01 22 5A 00 00 00"))
    assert host.receive().payload == b"\x0c"


def test_a_device_keeps_its_state(
    start: Start, start_node: Start, connect: Connect, files: dict[str, Path], tmp_path: Path
) -> None:
    """[PROFILE 4.3.2]: node id and sources stand in the state file, and outlive both programs; the device asks for its
    source by itself (pdcp-bus.md 7)."""
    state = tmp_path / "d2.state"
    text = files["d2"].read_text(encoding="utf-8").replace("[device]\n", f"[device]\nstate = {state}\n")
    files["d2"].write_text(text, encoding="utf-8")
    output, input_ = ChannelId(Identity(2, 2, 4), 1), ChannelId(Identity(2, 2, 5), 2)
    pdcpd = start("--can", "sim:0")
    host = connect(pdcpd)
    nodes = [start_node(pdcpd, files[name]) for name in ("d1", "d2")]
    until(lambda: host.system_info() == (2, 2, 4, 0), "two devices are set up")
    assert host.link(output, input_) is LinkStatus.ACTIVE
    for program in (*nodes, pdcpd):
        assert program.stop() == 0
    assert "node_id 32" in state.read_text(encoding="utf-8").splitlines()
    assert "source 2 0002 0002 0004 1 5000 2120" in state.read_text(encoding="utf-8").splitlines()
    pdcpd = start("--can", "sim:0")
    host = connect(pdcpd)
    for name in ("d2", "d1"):
        start_node(pdcpd, files[name])
    until(lambda: host.links() == [Link(1, output, input_, LinkStatus.ACTIVE)], "the link is back")


def test_nothing_is_left_in_the_working_folder(programs: Path, tmp_path: Path) -> None:
    process = subprocess.Popen(
        [programs / "pdcpd", "--can", "sim", "--host", "pty"], cwd=tmp_path, stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("host /dev/")
    finally:
        process.terminate()
        assert process.wait(END_TIMEOUT_S) == 0
    assert list(tmp_path.iterdir()) == []


def test_the_log_tells_what_a_host_changes(start: Start) -> None:
    """One line for each change, with its outcome; nothing of what was only read (D-LIN-7)."""
    pdcpd = start()
    with Client(pdcpd.port()) as host:
        host.info()
        host.action(Action.CLEAR)
        with pytest.raises(RequestError):
            host.unlink(ChannelId(Identity(9, 9, 9), 1))
    until(lambda: any("unlinks" in line for line in pdcpd.errors), "both lines are there")
    told = [line.partition("pdcpd: the host: ")[2] for line in pdcpd.errors if "the host" in line]
    assert told == ["removes all links", "unlinks 9:9:9.1: refused with error 03h"]
