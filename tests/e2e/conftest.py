"""What all end-to-end tests need: the programs, started and stopped with the test."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "tests/support")]

from programs import Pdcpd, Program  # noqa: E402
from rawhost import RawHost  # noqa: E402

# A job in the background ignores SIGINT, and so would every program that the tests start and end with Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)

DEFAULT_BIN = ROOT / "build/default/bin"
NODE_IDS = {"d1": 16, "d2": 32, "d3": 48}


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--bin", type=Path, default=DEFAULT_BIN, help="folder of pdcpd and pdcp-node")


@pytest.fixture
def programs(request: pytest.FixtureRequest) -> Path:
    folder: Path = request.config.getoption("--bin", DEFAULT_BIN)
    if not (folder / "pdcpd").exists():
        pytest.fail(f"there is no pdcpd in {folder}: build it, or say where it is with --bin")
    return folder.resolve()


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    """Everything entered here ends with the test, the last first."""
    with ExitStack() as things:
        yield things


@pytest.fixture
def start(programs: Path, stack: ExitStack) -> Callable[..., Pdcpd]:
    """start(ARGUMENT...): a running pdcpd; what the test does not say is --can sim --host pty."""

    def start_pdcpd(*arguments: str | Path) -> Pdcpd:
        words = list(arguments)
        words += [] if "--can" in words else ["--can", "sim"]
        words += [] if "--host" in words else ["--host", "pty"]
        return stack.enter_context(Pdcpd(programs, "--no-autoconfig", "--log", "info", *words))

    return start_pdcpd


@pytest.fixture
def start_node(programs: Path, stack: ExitStack) -> Callable[..., Program]:
    """start_node(PDCPD, FILE...): a running pdcp-node on the simulated bus of a pdcpd."""

    def start_pdcp_node(pdcpd: Pdcpd, *files: Path) -> Program:
        bus = f"socketcand:127.0.0.1:{pdcpd.bus_port()}/any"
        return stack.enter_context(Program([programs / "pdcp-node", "--can", bus, *files]))

    return start_pdcp_node


@pytest.fixture
def connect(stack: ExitStack) -> Callable[[Pdcpd], RawHost]:
    """connect(PDCPD): a host at its pseudo-terminal."""

    def connect_host(pdcpd: Pdcpd) -> RawHost:
        return stack.enter_context(RawHost(pdcpd.port()))

    return connect_host


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    """The descriptions of the three devices of acceptance system 2, with node ids of their own to ask for."""
    copies = {}
    for name, node_id in NODE_IDS.items():
        text = (ROOT / "tools/demo.d" / f"{name}.ini").read_text(encoding="utf-8")
        assert "[device]\n" in text
        copies[name] = tmp_path / f"{name}.ini"
        copies[name].write_text(text.replace("[device]\n", f"[device]\nnode_id = {node_id}\n"), encoding="utf-8")
    return copies


@pytest.fixture
def limb(start: Callable[..., Pdcpd], files: dict[str, Path]) -> Callable[..., Pdcpd]:
    """limb(ARGUMENT...): a running pdcpd with the three devices in it."""

    def start_limb(*arguments: str | Path) -> Pdcpd:
        return start(*arguments, *(word for path in files.values() for word in ("--node", path)))

    return start_limb
