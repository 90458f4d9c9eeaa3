"""What a frame costs the arbitrator, counted in instructions of kernel and user together.

    python -m tests.vm.frame_cost PROGRAMS RESULTS [TEST]...

In a virtual machine whose time advances by one nanosecond with each instruction (tools/vm/run --icount), a process's
time on the processor is the number of instructions carried out on its behalf: a count, the same on a busy machine.
"""

import json
import re
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from programs import Pdcpd, Program, until

from pdcp import Client
from tests.vm.bench import (
    D1,
    DEADLINE_S,
    INTERFACE,
    ROOT,
    Bench,
    is_asleep,
    listeners,
    main,
    run,
    run_time_ns,
    wake_ups,
)

FIGURES = ROOT / "build/vm/frame_cost.json"
TRACING = Path("/sys/kernel/tracing")
TRIGGER = TRACING / "events/raw_syscalls/sys_enter/trigger"
LOOP_ROUNDS = 200_000_000
GAPS_MS = ("1", "0.2")
FRAMES = 2000
WARM_UP_FRAMES = 200
CALLS_TO_SEND = 8  # a frame of its own, at most
STATS_BUS = 0
IDLE_S = 10.0
IDLE_NS = 10_000_000  # one tick


class Cost(NamedTuple):
    """Of one frame."""

    instructions: float
    wake_ups: float


def sleeps(program: Program) -> bool:
    assert not program.has_ended(), program.ended_error()
    return is_asleep(program.process.pid)


def send(node_id: int, gap_ms: str, count: int) -> None:
    """Beacons of a device."""
    run("cangen", INTERFACE, "-I", f"{node_id:03X}", "-L", "1", "-D", "0A", "-g", gap_ms, "-n", str(count))


def measure(program: Program, node_id: int, gap_ms: str) -> Cost:
    pid = program.process.pid
    send(node_id, gap_ms, WARM_UP_FRAMES)
    until(lambda: sleeps(program), f"{program.name} has read all frames", DEADLINE_S)
    before_ns, before_wake_ups = run_time_ns(pid), wake_ups(pid)
    send(node_id, gap_ms, FRAMES)
    until(lambda: sleeps(program), f"{program.name} has read all frames", DEADLINE_S)
    return Cost((run_time_ns(pid) - before_ns) / FRAMES, (wake_ups(pid) - before_wake_ups) / FRAMES)


def calibrate(bench: Bench) -> float:
    """Nanoseconds on the processor for one instruction."""
    loop = bench.program(bench.programs / "vm_busy_loop", str(LOOP_ROUNDS))
    until(lambda: sleeps(loop), "the loop is done", 120)
    each_ns = run_time_ns(loop.process.pid) / (2 * LOOP_ROUNDS)
    bench.say(f"one instruction of a busy loop takes {each_ns:.3f} ns on the processor")
    assert 0.95 < each_ns < 1.05, "instructions are not what is counted here"
    return each_ns


def measure_all(program: Program, node_id: int) -> dict[str, Cost]:
    return {gap_ms: measure(program, node_id, gap_ms) for gap_ms in GAPS_MS}


@contextmanager
def silent_device(bench: Bench, pdcpd: Pdcpd) -> Iterator[tuple[int, Client]]:
    """The node id of a device that is bound and set up, then silent itself: cangen beacons for it. And a host."""
    node = bench.node(bench.description("d1"))
    with bench.host() as host:
        until(lambda: host.system_info()[:3] == (1, 0, 1), "D1 is set up", DEADLINE_S)
        name = str(D1)
        line = next(line for line in pdcpd.errors if name in line)
        node.process.send_signal(signal.SIGSTOP)
        yield int(line.split("(id ")[1].split(")")[0]), host
        assert host.system_info()[:3] == (1, 0, 1), "the device was not lost"
    node.kill()


def measure_pdcpd(bench: Bench) -> tuple[int, dict[str, Cost]]:
    pdcpd = bench.pdcpd()
    with silent_device(bench, pdcpd) as (node_id, _):
        costs = measure_all(pdcpd, node_id)
    assert pdcpd.stop() == 0, pdcpd.errors
    return node_id, costs


def measure_candump(bench: Bench, node_id: int, arguments: str) -> dict[str, Cost]:
    before = listeners()
    candump = bench.program("sh", "-c", f"exec candump {arguments} {INTERFACE} >/dev/null")
    until(lambda: listeners() > before, "candump listens", DEADLINE_S)
    costs = measure_all(candump, node_id)
    candump.stop()
    return costs


def frame_costs_less_than_candump(bench: Bench) -> None:
    """A beacon of a bound device costs pdcpd fewer instructions, kernel and user, than it costs candump > /dev/null."""
    one_ns = calibrate(bench)
    node_id, pdcpd = measure_pdcpd(bench)
    others = {name: measure_candump(bench, node_id, name) for name in ("", "-s 2")}
    figures: dict[str, object] = {"ns_per_instruction": one_ns, "frames": FRAMES}
    ratios = []
    for gap_ms in GAPS_MS:
        candump, silent = others[""][gap_ms], others["-s 2"][gap_ms]
        ratio = pdcpd[gap_ms].instructions / candump.instructions
        ratios.append(ratio)
        figures[f"gap_{gap_ms}_ms"] = {
            "pdcpd": pdcpd[gap_ms]._asdict(),
            "candump": candump._asdict(),
            "candump_silent": silent._asdict(),
            "pdcpd_to_candump": ratio,
            "pdcpd_to_candump_silent": pdcpd[gap_ms].instructions / silent.instructions,
        }
        bench.say(
            f"gap {gap_ms} ms, instructions per frame: pdcpd {pdcpd[gap_ms].instructions:.0f}, "
            f"candump {candump.instructions:.0f}, candump -s 2 {silent.instructions:.0f}; "
            f"pdcpd to candump {ratio:.3f}; wake-ups per frame: pdcpd {pdcpd[gap_ms].wake_ups:.3f}, "
            f"candump {candump.wake_ups:.3f}"
        )
    FIGURES.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    print("\n".join(bench.notes), flush=True)
    assert max(ratios) < 1, "a frame costs pdcpd as much as candump, or more"


@contextmanager
def counted_system_calls(pid: int) -> Iterator[Callable[[], dict[str, int]]]:
    """The kernel counts the system calls of a process, by name, from now on."""
    if not TRIGGER.exists():
        run("mount", "-t", "tracefs", "tracefs", TRACING)
    TRIGGER.write_text(f"hist:keys=id.syscall if common_pid=={pid}\n", encoding="ascii")

    def counts() -> dict[str, int]:
        lines = TRIGGER.with_name("hist").read_text(encoding="ascii")
        found = re.findall(r"\{ id: sys_(\w+) +\[ *\d+\] *\} hitcount: +(\d+)", lines)
        return {name: int(count) for name, count in found}

    try:
        yield counts
    finally:
        TRIGGER.write_text(f"!hist:keys=id.syscall if common_pid=={pid}\n", encoding="ascii")


def frame_costs_two_system_calls(bench: Bench) -> None:
    """A beacon of a bound device: epoll_wait and recvmmsg, no other; beside them pdcpd sends frames of its own."""
    pdcpd = bench.pdcpd()
    with silent_device(bench, pdcpd) as (node_id, host):
        send(node_id, "1", WARM_UP_FRAMES)
        until(lambda: sleeps(pdcpd), "pdcpd has read all frames", DEADLINE_S)
        sent = host.stats(STATS_BUS)["tx"]
        until(lambda: sleeps(pdcpd), "pdcpd has answered", DEADLINE_S)
        with counted_system_calls(pdcpd.process.pid) as counts:
            send(node_id, "1", FRAMES)
            until(lambda: sleeps(pdcpd), "pdcpd has read all frames", DEADLINE_S)
            calls = counts()
        sent = host.stats(STATS_BUS)["tx"] - sent
    bench.say(f"{FRAMES} frames, {sent} of its own: {calls}")
    few = FRAMES // 50 + CALLS_TO_SEND * sent
    for name in ("epoll_wait", "recvmmsg"):
        assert FRAMES - few <= calls.pop(name, 0) <= FRAMES + few, f"not one {name} for each frame"
    assert sum(calls.values()) <= few, f"{calls} is more than its own frames need"


def arbitrator_without_devices_sleeps(bench: Bench) -> None:
    """In 10 s without devices: less than a tick on the processor, and one wake-up for each of its 20 beacons."""
    pdcpd = bench.pdcpd()
    pid = pdcpd.process.pid
    until(lambda: sleeps(pdcpd) and listeners() > 0, "pdcpd sleeps", DEADLINE_S)
    time.sleep(1)
    before_ns, before_wake_ups = run_time_ns(pid), wake_ups(pid)
    time.sleep(IDLE_S)
    used_ns, woken = run_time_ns(pid) - before_ns, wake_ups(pid) - before_wake_ups
    bench.say(f"in {IDLE_S:g} s: {used_ns} instructions, {woken} wake-ups")
    assert used_ns < IDLE_NS
    assert 18 <= woken <= 24


if __name__ == "__main__":
    main([frame_costs_less_than_candump, frame_costs_two_system_calls, arbitrator_without_devices_sleeps])
