"""Runs pdcpd and pdcp-node for scripts and tests: their lines are read all the time, and they end with their owner."""

import json
import os
import queue
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, NamedTuple, Self

from pdcp import Identity

# Only a program that hangs takes as long: a wait ends with what it waits for, however busy the machine is.
LINE_TIMEOUT_S = 30.0
END_TIMEOUT_S = 20.0
GONE_TIMEOUT_S = 5.0


class Value(NamedTuple):
    """What a terminal input received, from the JSON line that says so (host_sim/sim_node.h)."""

    time_ms: int
    device: Identity
    channel: int
    value: int | None  # None: a float
    safe: bool  # it went to its safe value, nothing was received


class EndedError(Exception):
    """A program ended although it was needed."""


def parse_value(line: str) -> Value:
    fields = json.loads(line)
    device = Identity(*(int(word) for word in fields["device"].split(":")))
    return Value(fields["t_ms"], device, fields["channel"], fields["value"], fields.get("safe", False))


class Program:
    """A running program. Values it prints wait in values; its other lines are kept in lines and errors."""

    def __init__(self, command: Sequence[str | os.PathLike[str]]) -> None:
        words = [os.fspath(word) for word in command]
        self.name = os.path.basename(words[0])  # noqa: PTH119 - a word of a command, not a path to work on
        self.values: queue.SimpleQueue[Value] = queue.SimpleQueue()
        self.lines: list[str] = []
        self.errors: list[str] = []
        self._changed = threading.Condition()
        # Not even a killed owner leaves it behind; and Ctrl-C is for the owner alone, who ends it in good order.
        guard = ["setpriv", "--pdeathsig", "TERM", "--"] if shutil.which("setpriv") else []
        self.process = subprocess.Popen(
            guard + words,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert self.process.stdout is not None and self.process.stderr is not None
        self._readers = [
            threading.Thread(target=self._read, args=(self.process.stdout, self.lines), daemon=True),
            threading.Thread(target=self._read, args=(self.process.stderr, self.errors), daemon=True),
        ]
        for reader in self._readers:
            reader.start()

    def _read(self, stream: IO[str], lines: list[str]) -> None:
        for line in stream:
            text = line.rstrip("\n")
            with self._changed:
                if text.startswith("{") and lines is self.lines and '"lost"' not in text:
                    self.values.put(parse_value(text))
                else:
                    lines.append(text)
                self._changed.notify_all()

    def has_ended(self) -> bool:
        return self.process.poll() is not None

    def ends(self) -> bool:
        """Waits for the end of a program whose line is gone: the kernel closes its files a moment before it ends."""
        with suppress(subprocess.TimeoutExpired):
            self.wait(GONE_TIMEOUT_S)
        return self.has_ended()

    def ended_error(self) -> EndedError:
        """Says how it ended and what it had to say about it."""
        status = self.wait()
        how = f"signal {signal.Signals(-status).name}" if status < 0 else f"exit status {status}"
        return EndedError("\n".join([f"{self.name} ended early ({how})", *self.errors[-5:]]))

    def line(self, prefix: str, timeout_s: float = LINE_TIMEOUT_S) -> str:
        """Waits for a line of standard output that begins with prefix and returns what follows it."""
        deadline = time.monotonic() + timeout_s
        with self._changed:
            while True:
                for line in self.lines:
                    if line.startswith(prefix):
                        return line.removeprefix(prefix)
                if not any(reader.is_alive() for reader in self._readers):
                    break
                if time.monotonic() > deadline:
                    raise TimeoutError(f"{self.name} did not print '{prefix}...' in {timeout_s:g} s")
                self._changed.wait(0.05)
        raise self.ended_error()

    def wait(self, timeout_s: float = END_TIMEOUT_S) -> int:
        """Waits for its end. Returns the exit status, negative for a signal."""
        status = self.process.wait(timeout_s)
        for reader in self._readers:
            reader.join(timeout_s)
        return status

    def stop(self) -> int:
        """Ends it with SIGTERM, with SIGKILL when it does not listen. Returns the exit status."""
        if not self.has_ended():
            self.process.terminate()
        try:
            return self.wait()
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.wait()

    def kill(self) -> None:
        """Ends it as a power cut does."""
        self.process.kill()
        self.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


class Pdcpd(Program):
    """A running arbitrator."""

    def __init__(self, folder: Path, *arguments: str | os.PathLike[str]) -> None:
        super().__init__([folder / "pdcpd", *arguments])

    def port(self) -> str:
        """The pseudo-terminal for the host."""
        return self.line("host ")

    def bus_port(self) -> int:
        """The TCP port of the simulated bus."""
        return int(self.line("bus 127.0.0.1:"))


def until(condition: Callable[[], bool], what: str, timeout_s: float = LINE_TIMEOUT_S) -> None:
    """Waits until a condition holds."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"after {timeout_s:g} s still not: {what}")
        time.sleep(0.01)
