"""What the tests on a real vcan0 need: the programs, can-utils beside them, and a result for each test.

Everything runs as root with vcan0 up, in the virtual machine of tools/vm/run. That may be twenty times slower than the
machine around it: conditions are awaited with long deadlines, and nothing is assumed about how fast a program is.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from programs import Pdcpd, Program, until

from pdcp import ChannelId, Client, Identity, LinkStatus

ROOT = Path(__file__).resolve().parents[2]
INTERFACE = "vcan0"
DEADLINE_S = 90.0  # only what hangs takes as long
LOG_LINES = 150

D1, D2, D3 = (Identity(2, 2, serial) for serial in (4, 5, 6))
DEVICES = {"d1": D1, "d2": D2, "d3": D3}
LINKS = {
    (ChannelId(D1, 1), ChannelId(D2, 2)),
    (ChannelId(D2, 3), ChannelId(D3, 1)),
    (ChannelId(D2, 5), ChannelId(D3, 2)),
}
PARAMETER_NODE_ID = 8  # of a device
PARAMETER_OUTPUT_ID = 5  # of an output channel


# --- the machine ---


def run(*command: str | Path) -> str:
    """Runs a program to its end and returns what it prints. Raises when it fails."""
    done = subprocess.run([*map(str, command)], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command} failed with {done.returncode}: {done.stderr.strip()}"
    return done.stdout


def cansend(frame: str) -> None:
    run("cansend", INTERFACE, frame)


def interface_up() -> None:
    """vcan0 as a test expects it: there, up, without a queue of its own."""
    if not Path("/sys/class/net", INTERFACE).exists():
        run("ip", "link", "add", "dev", INTERFACE, "type", "vcan")
    subprocess.run(["tc", "qdisc", "del", "dev", INTERFACE, "root"], stderr=subprocess.DEVNULL, check=False)
    run("ip", "link", "set", INTERFACE, "up")


def cpu_ticks(pid: int) -> int:
    """User and system time of a process, in ticks of 10 ms."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


def run_time_ns(pid: int) -> int:
    """Time on the processor, kernel and user, to the nanosecond; exact while the process sleeps."""
    return int(Path(f"/proc/{pid}/schedstat").read_text(encoding="ascii").split()[0])


def wake_ups(pid: int) -> int:
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    found = re.search(r"^voluntary_ctxt_switches:\s*(\d+)", status, re.MULTILINE)
    assert found is not None
    return int(found[1])


def is_asleep(pid: int) -> bool:
    return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] == "S"


def listeners() -> int:
    """How many sockets take all frames of vcan0."""
    lines = Path("/proc/net/can/rcvlist_all").read_text(encoding="ascii").splitlines()
    return sum(line.split()[:1] == [INTERFACE] for line in lines)


# --- can-utils ---


class Frame(NamedTuple):
    """A line of candump -L; text is the frame as cansend takes it."""

    time_s: float
    text: str


class Candump(Program):
    """candump -L, all frames of vcan0 from now on. Arguments are its filters."""

    def __init__(self, *filters: str) -> None:
        self._frames: list[Frame] = []
        before = listeners()
        super().__init__(["candump", "-L", ",".join([INTERFACE, *filters])])
        if not filters:
            until(lambda: listeners() > before, "candump listens", DEADLINE_S)

    def frames(self) -> list[Frame]:
        """All frames so far, in a list that grows."""
        for line in self.lines[len(self._frames) :]:
            time_s, _, text = line.split()
            self._frames.append(Frame(float(time_s.strip("()")), text))
        return self._frames

    def texts(self) -> list[str]:
        return [frame.text for frame in self.frames()]

    def find(self, pattern: str, start: int = 0) -> re.Match[str] | None:
        """The first frame from number start on that the pattern matches whole."""
        matches = (re.fullmatch(pattern, text) for text in self.texts()[start:])
        return next((match for match in matches if match is not None), None)

    def await_frame(self, pattern: str, start: int = 0) -> re.Match[str]:
        until(lambda: self.find(pattern, start) is not None, f"candump shows {pattern}", DEADLINE_S)
        match = self.find(pattern, start)
        assert match is not None
        return match


class Player:
    """canplayer, kept running: sends a frame without the time that the start of cansend takes."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(["canplayer", "-t"], stdin=subprocess.PIPE, text=True, bufsize=1)

    def send(self, frame: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"(0.000000) {INTERFACE} {frame}\n")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()


# --- one test ---


class Bench:
    """Starts what one test uses, and ends it with the test."""

    def __init__(self, programs: Path) -> None:
        self.programs = programs
        self.folder = Path(tempfile.mkdtemp(prefix="pdcp-vm-"))
        self.notes: list[str] = []
        self._started: list[Program] = []
        self._stack = ExitStack()
        self._stack.callback(shutil.rmtree, self.folder)
        interface_up()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def say(self, text: str) -> None:
        self.notes.append(text)

    def program(self, *command: str | Path) -> Program:
        return self._started_one(Program([*command]))

    def _started_one(self, program: Program) -> Program:
        self._started.append(self._stack.enter_context(program))
        return program

    def pdcpd(self, *arguments: str | Path, autoconfig: bool = False) -> Pdcpd:
        """pdcpd on vcan0 that makes no links unasked; its host's port is the link "host" in the test's folder."""
        port = f"pty:{self.folder / 'host'}"
        words = ["--can", f"socketcan:{INTERFACE}", "--host", port, "--log", "info", *arguments]
        pdcpd = Pdcpd(self.programs, *words, *([] if autoconfig else ["--no-autoconfig"]))
        self._started_one(pdcpd)
        pdcpd.port()
        return pdcpd

    def node(self, *arguments: str | Path) -> Program:
        return self.program(self.programs / "pdcp-node", "--can", f"socketcan:{INTERFACE}", *arguments)

    def candump(self, *filters: str) -> Candump:
        candump = Candump(*filters)
        self._started_one(candump)
        return candump

    def player(self) -> Player:
        return self._stack.enter_context(Player())

    def host(self) -> Client:
        """A host at the link that the last pdcpd made."""
        return self._stack.enter_context(Client(str(self.folder / "host"), timeout_s=DEADLINE_S))

    def description(self, name: str, rate_ms: int | None = None, node_id: int | None = None) -> Path:
        """A device of tools/demo.d; rate_ms replaces the rate of a sensor, node_id is the one to ask for."""
        text = (ROOT / "tools/demo.d" / f"{name}.ini").read_text(encoding="utf-8")
        if node_id is not None:
            text = text.replace("[device]\n", f"[device]\nnode_id = {node_id}\n")
        if rate_ms is not None:
            text, count = re.subn(r"(?m)^rate_ms = \d+$", f"rate_ms = {rate_ms}", text)
            assert count == 1, f"{name} has no rate to replace"
        path = self.folder / f"{name}.ini"
        path.write_text(text, encoding="utf-8")
        return path

    def logs(self) -> str:
        """The last lines of every program."""
        texts = []
        for program in self._started:
            state = "has ended" if program.has_ended() else "runs"
            texts.append(f"--- {program.name} ({program.process.pid}, {state})")
            texts += program.lines[-LOG_LINES:] + program.errors[-LOG_LINES:]
        return "\n".join(texts)


class Limb:
    """Acceptance system 2: pdcpd, three processes with one device each, and a host."""

    def __init__(
        self, bench: Bench, *pdcpd_arguments: str | Path, sensor_rate_ms: int | None = None, autoconfig: bool = False
    ) -> None:
        self.pdcpd = bench.pdcpd(*pdcpd_arguments, autoconfig=autoconfig)
        rates = {"d1": sensor_rate_ms}
        self.nodes = {name: bench.node("--stats", bench.description(name, rates.get(name))) for name in DEVICES}
        self.host = bench.host()

    def link(self) -> None:
        until(lambda: self.host.system_info()[:3] == (3, 4, 4), "3 devices, 4 inputs, 4 outputs", DEADLINE_S)
        for output, input_ in sorted(LINKS):
            assert self.host.link(output, input_) == LinkStatus.ACTIVE, f"{output} to {input_}"

    def links(self) -> dict[tuple[ChannelId, ChannelId], int]:
        return {(link.output, link.input): link.status for link in self.host.links()}

    def is_linked(self) -> bool:
        return self.host.system_info()[:3] == (3, 4, 4) and self.links() == dict.fromkeys(LINKS, LinkStatus.ACTIVE)

    def node_ids(self) -> list[int]:
        return [self.host.get_parameter(ChannelId(each), PARAMETER_NODE_ID)[0] for each in DEVICES.values()]

    def output_id(self, device: Identity, channel: int) -> int:
        return self.host.get_parameter(ChannelId(device, channel), PARAMETER_OUTPUT_ID)[0]

    def pids(self) -> dict[str, int]:
        return {"pdcpd": self.pdcpd.process.pid} | {name: node.process.pid for name, node in self.nodes.items()}

    def received(self) -> dict[int, list[int | None]]:
        """What has arrived at the inputs of D3 since this was last asked for, without safe values."""
        values: dict[int, list[int | None]] = {1: [], 2: []}
        queue = self.nodes["d3"].values
        while not queue.empty():
            value = queue.get()
            if not value.safe:
                values[value.channel].append(value.value)
        return values

    def await_values(self, count: int) -> None:
        """So many new values arrive at each input of D3."""
        self.received()
        counts = {1: 0, 2: 0}

        def arrived() -> bool:
            for channel, values in self.received().items():
                counts[channel] += len(values)
            return min(counts.values()) >= count

        until(arrived, f"{count} values arrive at each input of D3", DEADLINE_S)


# --- all tests ---


Test = Callable[[Bench], None]


def main(tests: Sequence[Test]) -> None:
    """Arguments: the folder of the programs, the folder for the results, and the tests to run if not all."""
    programs, results, *names = sys.argv[1:]
    run_tests(Path(programs), Path(results), [test for test in tests if not names or test.__name__ in names])


def run_tests(programs: Path, results: Path, tests: Sequence[Test]) -> None:
    """Runs tests one after the other; results gets a file for each, its first line `passed` or `failed`."""
    results.mkdir(parents=True, exist_ok=True)
    for test in tests:
        (results / test.__name__).unlink(missing_ok=True)
    for test in tests:
        started_s = time.monotonic()
        with Bench(programs) as bench:
            verdict, details = "passed", ""
            try:
                test(bench)
            except Exception:  # noqa: BLE001 - whatever it is, the next test is to run
                verdict, details = "failed", f"{traceback.format_exc()}{bench.logs()}\n"
        took_s = time.monotonic() - started_s
        text = "\n".join([verdict, *(line for line in [test.__doc__ or ""] if line), *bench.notes, details])
        (results / test.__name__).write_text(text, encoding="utf-8")
        print(f"{verdict} {took_s:5.1f} s {test.__name__}", flush=True)
