"""pdcpd with a USB CAN adapter that it drives itself, against an emulated adapter whose CAN side is vcan0.

    python -m tests.usb.on_usb PROGRAMS RESULTS [TEST]...

First the kernel is the judge of the emulated adapter: its own gs_usb driver takes it for real. Then the emulated
adapter is the judge of pdcpd.
"""

import json
import re
import subprocess
import time
from pathlib import Path
from typing import Any

from programs import Program, until

from tests.usb.adapter import SERIAL, Adapter
from tests.vm.bench import DEADLINE_S, INTERFACE, Bench, Limb, cpu_ticks, listeners, main, run

BUS_OFF, STOPPED = 3, 4  # states of an adapter
SENDS_MAX = 10
UNPLUGS = 10
IDLE_TICKS = 25
STATS_BUS = 0
FRAMES = 10_000
FRAMES_SHORT = 1_000
VCAN = f"socketcan:{INTERFACE}"
NOBODY = "65534"


# --- streams of numbered frames ---


def open_stream(bench: Bench, bus: str, identifier: str, send: int, receive: int, *more: str) -> Program:
    words = (bus, identifier, str(send), str(receive), *more)
    stream = bench.program(bench.programs / "can_stream", *words)
    stream.line("open", DEADLINE_S)
    return stream


def result(stream: Program) -> dict[str, int]:
    counters: dict[str, int] = json.loads(stream.line("result ", DEADLINE_S))
    return counters


def stream_both_ways(bench: Bench, bus: str, count: int) -> dict[str, int]:
    """Frames both ways at once between a bus and vcan0; none may be lost, repeated or out of order."""
    other = open_stream(bench, VCAN, "222", count, count, "wait")
    results = [result(stream) for stream in (open_stream(bench, bus, "111", count, count), other)]
    for each in results:
        assert (each["sent"], each["received"], each["gaps"]) == (count, count, 0), results
        assert (each["overruns"], each["failed"]) == (0, 0), results
    bench.say(f"{count} frames each way in {results[0]['ms']} ms: {1000 * count // results[0]['ms']} frames/s each way")
    return results[0]


# --- the emulated adapter and the kernel's driver ---


def kernel_interface() -> str | None:
    """The interface that the kernel's driver made of the adapter."""
    drivers = Path("/sys/class/net").glob("*/device/driver")
    return next((path.parts[-3] for path in drivers if path.resolve().name == "gs_usb"), None)


def await_kernel_interface() -> str:
    until(lambda: kernel_interface() is not None, "the kernel's gs_usb driver binds to the adapter", DEADLINE_S)
    name = kernel_interface()
    assert name is not None
    return name


def can_state(name: str) -> str:
    found = re.search(r"can state ([A-Z-]+)", run("ip", "-d", "link", "show", name))
    assert found is not None
    return found[1]


def check_adapter(report: dict[str, Any], starts: int) -> None:
    """It was always asked in the right order, with requests and frames that are right."""
    assert (report["bad_requests"], report["bad_frames"], report["unformatted"]) == (0, 0, 0), report
    assert (report["starts"], report["plugged"]) == (starts, starts), report


def check_kernel_sees_errors(bench: Bench, adapter: Adapter, name: str) -> None:
    """Error counters, states, bus-off and the adapter's own recovery after 100 ms arrive at the kernel."""
    candump = bench.program("candump", "-L", f"{name},0:0,#FFFFFFFF")
    adapter.ask("errors 100 0")
    until(lambda: can_state(name) == "ERROR-WARNING", "the kernel's driver knows the warning", DEADLINE_S)
    adapter.ask("errors 0 130")
    until(lambda: can_state(name) == "ERROR-PASSIVE", "the kernel's driver is error-passive", DEADLINE_S)
    adapter.ask("bus-off")
    until(lambda: adapter.ask()["restarts"] == 1, "the adapter restarts by itself", DEADLINE_S)
    until(lambda: can_state(name) == "ERROR-ACTIVE", "the kernel's driver is active again", DEADLINE_S)
    assert adapter.ask()["bad_requests"] == 0
    bench.say("error frames as candump shows them: " + ", ".join(line.split()[2] for line in candump.lines))


def kernel_driver_binds_and_talks(bench: Bench) -> None:
    """The kernel makes a CAN interface of the emulated adapter, and can-utils talk through it to vcan0 and back."""
    with Adapter(bench.programs, bench.folder) as adapter:
        name = await_kernel_interface()
        run("ip", "link", "set", name, "up", "type", "can", "bitrate", "1000000")
        shown = run("ip", "-d", "link", "show", name)
        assert "clock 48000000" in shown and "bitrate 1000000" in shown, shown
        before = listeners()
        candump = bench.program("candump", "-L", f"{INTERFACE},#FFFFFFFF", f"{name},#FFFFFFFF")
        until(lambda: listeners() > before, "candump listens", DEADLINE_S)
        frames = ["123#1122", "7FF#0102030405060708", "000#", "12345678#AA", "321#R3"]
        for frame in frames:
            run("cansend", name, frame)
            run("cansend", INTERFACE, frame)

        def seen(interface: str) -> list[str]:
            fields = [line.split() for line in candump.lines]
            return [text for _, where, text in fields if where == interface]

        # Each sees what it has sent itself, which candump is given back, and what came over the adapter.
        until(lambda: len(seen(INTERFACE)) + len(seen(name)) == 4 * len(frames), "candump shows all", DEADLINE_S)
        twice = sorted(2 * frames)
        assert sorted(seen(INTERFACE)) == twice and sorted(seen(name)) == twice, candump.lines
        candump.stop()
        stream_both_ways(bench, f"socketcan:{name}", 500)
        report = adapter.ask()
        check_adapter(report, starts=1)
        bench.say(f"the kernel's timing: {report['timing']}, flags {report['flags']:#x}")
        check_kernel_sees_errors(bench, adapter, name)
        run("ip", "link", "set", name, "down")
        assert adapter.ask()["state"] == STOPPED


# --- pdcpd ---


def await_links(limb: Limb) -> None:
    """Asks seldom: in a machine without acceleration a host's questions cost more than the limb itself."""
    deadline_s = time.monotonic() + DEADLINE_S
    while not limb.is_linked():
        assert time.monotonic() < deadline_s, f"the limb is not linked: {limb.links()}"
        time.sleep(0.25)


def states(limb: Limb) -> list[str]:
    return [line.rpartition(": ")[2] for line in limb.pdcpd.errors if "bus state" in line]


def check_errors_and_bus_off(bench: Bench, adapter: Adapter, limb: Limb) -> None:
    """Error frames are counted, states are told, after bus-off the arbitrator restarts the controller."""
    before = limb.host.stats(STATS_BUS)
    adapter.ask("errors 130 7")
    until(lambda: states(limb)[-1:] == ["error-passive"], "error-passive is told", DEADLINE_S)
    adapter.ask("errors 5 0")
    until(lambda: states(limb)[-1:] == ["active"], "active is told", DEADLINE_S)
    started_s = time.monotonic()
    report = adapter.ask("bus-off")
    assert report["state"] == BUS_OFF and report["restarts"] == 0, report
    until(lambda: states(limb)[-2:] == ["bus-off", "active"], "bus-off and recovery are told", DEADLINE_S)
    bench.say(f"back from bus-off after {time.monotonic() - started_s:.2f} s")
    assert adapter.ask()["restarts"] == 1, "it was not the host who restarted it"
    await_links(limb)
    limb.await_values(20)
    after = limb.host.stats(STATS_BUS)
    # Two changes of the error counters, bus-off, restarted.
    assert after["drop_error"] - before["drop_error"] == 4, after
    assert after["bus_off"] - before["bus_off"] == 1, after


def check_unplugs(bench: Bench, adapter: Adapter, limb: Limb) -> None:
    """D-LIN-1: pulled out and plugged in ten times, the daemon waits without much work and comes back."""
    times: list[float] = []
    for i in range(UNPLUGS):
        adapter.unplug()
        until(lambda: states(limb)[-1:] == ["down"], "the loss of the bus is told", DEADLINE_S)
        if i == 0:
            before = cpu_ticks(limb.pdcpd.process.pid)
            time.sleep(1)
            ticks = cpu_ticks(limb.pdcpd.process.pid) - before
            bench.say(f"ticks of 10 ms in a second without the adapter: {ticks}")
            assert ticks < IDLE_TICKS
        adapter.plug()
        plugged_s = time.monotonic()
        until(lambda: states(limb)[-1:] == ["active"], "the bus is back", DEADLINE_S)
        times.append(time.monotonic() - plugged_s)
        await_links(limb)
        limb.await_values(5)
    assert states(limb).count("down") == UNPLUGS
    bench.say(f"from plugged in to active: {min(times):.2f} to {max(times):.2f} s")


def limb_lives_through_errors_bus_off_and_ten_unplugs(bench: Bench) -> None:
    """Acceptance system 2 with --can gs_usb: three devices bind and are linked, values arrive, whatever befalls the
    adapter; the kernel's driver gives it up for pdcpd and gets it back at the end."""
    with Adapter(bench.programs, bench.folder) as adapter:
        await_kernel_interface()
        # Acceptance system 2: the arbitrator on the adapter, three devices on vcan0; it links them by itself.
        limb = Limb(bench, "--can", "gs_usb", autoconfig=True)
        await_links(limb)
        limb.await_values(50)
        assert kernel_interface() is None, "the kernel's driver still has the adapter"
        counters = limb.host.stats(STATS_BUS)
        assert counters["tx_full"] == 0 and counters["no_answer"] == 0, counters
        report = adapter.ask()
        check_adapter(report, starts=1)
        # 48 MHz: 3 clocks a quantum, 16 quanta a bit, 14 before the sample point: 1 Mbit/s, 87.5 %.
        assert report["timing"] == [1, 12, 2, 1, 3], report
        check_errors_and_bus_off(bench, adapter, limb)
        check_unplugs(bench, adapter, limb)
        check_adapter(adapter.ask(), starts=1 + UNPLUGS)
        assert limb.pdcpd.stop() == 0, limb.pdcpd.errors
        await_kernel_interface()


def ten_thousand_frames_each_way(bench: Bench) -> None:
    """As fast as the emulated adapter carries them; none lost, repeated or out of order."""
    with Adapter(bench.programs, bench.folder) as adapter:
        stream_both_ways(bench, f"gs_usb:{SERIAL}", FRAMES)
        report = adapter.ask()
        assert report["from_host"] == report["echoes"] == FRAMES, report
        assert 1 < report["in_flight_max"] <= SENDS_MAX and report["bad_frames"] == 0, report
        bench.say(f"frames under way at most: {report['in_flight_max']}")


def bus_off_in_a_stream_loses_no_frame(bench: Bench) -> None:
    """D-LIN-3: bus-off stops the stream; the host's restart lets it go on where it stopped."""
    with Adapter(bench.programs, bench.folder) as adapter:
        other = open_stream(bench, VCAN, "222", 0, FRAMES_SHORT)
        adapter.ask(f"bus-off-after {FRAMES_SHORT // 10}")
        stream = open_stream(bench, "gs_usb", "111", FRAMES_SHORT, 0)
        sent, received = result(stream), result(other)
        report = adapter.ask()
        assert (sent["bus_offs"], report["restarts"], report["starts"]) == (1, 1, 1), (sent, report)
        assert (sent["sent"], sent["failed"]) == (FRAMES_SHORT, 0), sent
        assert (received["received"], received["gaps"]) == (FRAMES_SHORT, 0), received
        assert report["in_flight_max"] <= SENDS_MAX, report


def fd_firmware_that_pads_its_packets(bench: Bench) -> None:
    """CAN FD firmware, used in classic mode, with every packet filled up, and a clock of 80 MHz."""
    with Adapter(bench.programs, bench.folder, "fd", "pad") as adapter:
        stream_both_ways(bench, "gs_usb/0", 500)
        report = adapter.ask()
        # 80 MHz: 80 quanta of one clock, 70 before the sample point.
        assert report["timing"] == [1, 68, 10, 5, 1], report
        assert report["flags"] & (1 << 8) == 0 and report["bad_requests"] == 0, report


def old_firmware_is_reset_after_bus_off(bench: Bench) -> None:
    """D-LIN-3: firmware that only a reset brings back from bus-off: what it throws away then is counted as not sent."""
    with Adapter(bench.programs, bench.folder, "old") as adapter:
        other = open_stream(bench, VCAN, "222", 0, 1)
        adapter.ask(f"bus-off-after {FRAMES_SHORT // 10}")
        stream = open_stream(bench, "gs_usb", "111", FRAMES_SHORT, 0)
        sent = result(stream)
        report = adapter.ask()
        assert (report["starts"], report["restarts"], report["bad_requests"]) == (2, 0, 0), report
        assert (sent["bus_offs"], sent["sent"]) == (1, FRAMES_SHORT), sent
        assert sent["failed"] == report["lost"] and sent["failed"] + report["echoes"] == FRAMES_SHORT, (sent, report)
        bench.say(f"thrown away by the reset: {report['lost']}")
        other.stop()


# --- what a user is told ---


def refusal(bench: Bench, *command: str | Path) -> str:
    done = subprocess.run(
        [*map(str, command)], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, timeout=DEADLINE_S
    )
    assert done.returncode == 3, done
    lines = done.stderr.splitlines()
    assert len(lines) == 1, lines
    bench.say(lines[0])
    return lines[0]


def list_and_refusals(bench: Bench) -> None:
    """--list shows the adapter and vcan0; no adapter, no right, in use, no such serial number or channel: one line."""
    pdcpd = bench.programs / "pdcpd"
    port = ("--host", "pty")
    with Adapter(bench.programs, bench.folder, plugged=False) as adapter:
        assert "no such adapter" in refusal(bench, pdcpd, "--can", "gs_usb", *port)
        adapter.plug()
        listed = run(pdcpd, "--list")
        assert re.search(rf"(?m)^can +gs_usb:{SERIAL} .*1d50:606f emulated adapter$", listed), listed
        assert re.search(rf"(?m)^can +{VCAN} .*up$", listed), listed
        assert re.search(r"(?m)^host +serial:/dev/tty", listed), listed
        bench.say(listed)
        assert "no such adapter" in refusal(bench, pdcpd, "--can", "gs_usb:77", *port)
        assert "no channel 1" in refusal(bench, pdcpd, "--can", f"gs_usb:{SERIAL}/1", *port)
        nobody = ("setpriv", "--reuid", NOBODY, "--regid", NOBODY, "--clear-groups")
        told = refusal(bench, *nobody, pdcpd, "--can", "gs_usb", *port)
        assert 'ATTR{idVendor}=="1d50", ATTR{idProduct}=="606f", TAG+="uaccess"' in told
        assert "no right to open it" in run(*nobody, pdcpd, "--list")
        open_stream(bench, "gs_usb", "111", 0, 1)
        assert "in use" in refusal(bench, pdcpd, "--can", "gs_usb", *port)


TESTS = [
    kernel_driver_binds_and_talks,
    limb_lives_through_errors_bus_off_and_ten_unplugs,
    ten_thousand_frames_each_way,
    bus_off_in_a_stream_loses_no_frame,
    fd_firmware_that_pads_its_packets,
    old_firmware_is_reset_after_bus_off,
    list_and_refusals,
]

if __name__ == "__main__":
    main(TESTS)
