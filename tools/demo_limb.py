#!/usr/bin/env python3
"""The demonstration behind tools/demo: a limb of three simulated devices that links itself, and repairs itself when its
sensor is replaced by another one. The host only looks.

Exit status: 0 all well, 1 something failed, 2 wrong use.
"""

import argparse
import configparser
import math
import os
import queue
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import NamedTuple, NoReturn

from programs import EndedError, Pdcpd, Program, Value, until
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from pdcp import ChannelId, Client, ConnectionFailedError, Identity, LinkStatus, PdcpError
from pdcp.cli.common import new_table

FOLDER = Path(__file__).resolve().parent / "demo.d"
SENSOR, CONTROLLER, HAND, SPARE = (FOLDER / f"d{number}.ini" for number in (1, 2, 3, 4))
LINKS = 3  # that the limb makes
WRIST, GRIP = 1, 2  # the terminal inputs of the third device

WIDTH = 80
WIDTH_MIN = 60
NAME_WIDTH = 13
TRACE_WIDTH = 30
STEP_S = 0.05  # of a trace
SETUP_TIMEOUT_S = 15.0
ONCE_LIMIT_S = 30.0  # until values are the sine: a busy machine lets them wait
ENOUGH = 75  # values at each input to tell whether they are the sine
JUDGED = 200  # newest values of both inputs, 2 s; they are judged whenever so many more have come:
JUDGED_STEP = 50
REPAIRED_ONCE_S = 0.6
BEFORE_SWAP_S = 8.0  # unless --once
PULLED_S = 1.0  # between the loss and the replacement
SILENCE_S = 5.0  # without a value: the demonstration has failed
PLAIN_EVERY_S = 0.2
LATE_MS = 300  # later than others, as a rule: the system lets the sensor wait
LATE_SHARE = 0.1  # of the values may come later than that
ROUNDING = 1  # of a sample to a whole number
KEPT_MAX = 10000  # values
FULL_RANGE = 255  # of the 8-bit channels that the sine passes through

DEVICE_DESCRIPTOR = 7
DEVICE_NODE_ID = 8
CHANNEL_DESCRIPTOR = 2


Values = Generator[Value, None, None]


class DemoError(Exception):
    """The demonstration cannot go on; the text says why."""


class Sine(NamedTuple):
    """signal = sine LOW HIGH PERIOD_MS of a description file."""

    low: int
    high: int
    period_ms: int
    rate_ms: int

    def at(self, time_ms: int) -> float:
        turn = time_ms % self.period_ms / self.period_ms
        return (self.low + self.high) / 2 + (self.high - self.low) / 2 * math.sin(2 * math.pi * turn)


class Names(NamedTuple):
    """Descriptors and node ids, as the devices themselves tell them."""

    descriptors: dict[ChannelId, str]
    node_ids: dict[ChannelId, int]


def parse_ini(path: Path) -> configparser.ConfigParser:
    parser = configparser.ConfigParser(inline_comment_prefixes=(";",), interpolation=None)
    with path.open(encoding="utf-8") as file:
        parser.read_file(file)
    return parser


def read_identity(path: Path) -> Identity:
    device = parse_ini(path)["device"]
    return Identity(*(int(device[key], 0) for key in ("vid", "pid", "serial")))


def read_sine(path: Path) -> Sine:
    channel = parse_ini(path)["channel 1"]
    words = channel.get("signal", "").split()
    if len(words) != 4 or words[0] != "sine":
        raise DemoError(f"{path.name}: the signal of channel 1 is no sine; --once cannot check it")
    return Sine(int(words[1]), int(words[2]), int(words[3]), channel.getint("rate_ms", 100))


# --- the limb ---


class Limb:
    """pdcpd with the controller and the hand in it, and a sensor as a process of its own, to be pulled and plugged."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self._folder = folder
        self._stack = stack
        nodes = [word for path in (CONTROLLER, HAND) for word in ("--node", path)]
        self.pdcpd = stack.enter_context(Pdcpd(folder, "--can", "sim:0", "--host", "pty", *nodes))
        self.hand = read_identity(HAND)
        self._bus = f"socketcand:127.0.0.1:{self.pdcpd.bus_port()}/demo"

    def plug(self, path: Path) -> Program:
        return self._stack.enter_context(Program([self._folder / "pdcp-node", "--can", self._bus, path]))

    def drop_old(self) -> None:
        """Forgets the values that came before this moment."""
        while not self.pdcpd.values.empty():
            self.pdcpd.values.get()


def wait_for_links(host: Client) -> None:
    def is_linked() -> bool:
        links = host.links()
        return len(links) == LINKS and all(link.status is LinkStatus.ACTIVE for link in links)

    until(is_linked, f"{LINKS} links are made", SETUP_TIMEOUT_S)


def read_names(host: Client) -> Names:
    descriptors: dict[ChannelId, str] = {}
    node_ids: dict[ChannelId, int] = {}
    for device in host.devices():
        descriptors[device.id] = host.get_parameter(device.id, DEVICE_DESCRIPTOR).decode(errors="replace")
        node_ids[device.id] = host.get_parameter(device.id, DEVICE_NODE_ID)[0]
    for channel in (*host.inputs(), *host.outputs()):
        descriptors[channel.id] = host.get_parameter(channel.id, CHANNEL_DESCRIPTOR).decode(errors="replace")
    return Names(descriptors, node_ids)


# --- tables ---


def device_table(host: Client, names: Names) -> Table:
    table = new_table("Devices")
    table.add_column("device", style="bold")
    table.add_column("VID:PID:SN")
    table.add_column("node id", justify="right")
    table.add_column("inputs", justify="right")
    table.add_column("outputs", justify="right")
    inputs, outputs = host.inputs(), host.outputs()
    for device in sorted(host.devices(), key=lambda each: each.id):
        counts = [sum(each.id.identity == device.identity for each in channels) for channels in (inputs, outputs)]
        texts = [str(number) for number in (device.identity, names.node_ids[device.id], *counts)]
        table.add_row(names.descriptors[device.id], *texts)
    return table


def link_table(host: Client, names: Names) -> Table:
    profiles = {channel.id: f"{channel.profile:04X}h" for channel in (*host.inputs(), *host.outputs())}

    def end(channel: ChannelId) -> tuple[str, str]:
        device = names.descriptors[ChannelId(channel.identity)]
        return f"{device}, {channel.index} {names.descriptors[channel]}", profiles[channel]

    table = new_table("Links")
    for name in ("output", "profile", "", "input", "profile", "status"):
        table.add_column(name)
    for link in sorted(host.links(), key=lambda each: each.output):
        active = link.status is LinkStatus.ACTIVE
        status = Text("active", style="green") if active else Text("inactive", style="red")
        table.add_row(*end(link.output), "→", *end(link.input), status)
    return table


# --- values ---


class Trace:
    """The last values of one input, drawn as a number, a bar and a line."""

    BLOCKS = "▁▂▃▄▅▆▇█"

    def __init__(self, name: str, highest: int) -> None:
        self.name = name
        self.highest = highest
        self.value: int | None = None
        self._history: deque[float] = deque([0.0] * TRACE_WIDTH, TRACE_WIDTH)

    def share(self) -> float:
        return min(max((self.value or 0) / self.highest, 0.0), 1.0)

    def step(self) -> None:
        """Moves the line on."""
        self._history.append(self.share())

    def number(self) -> str:
        return "-" if self.value is None else str(self.value)

    def row(self, bar_width: int) -> tuple[Text, Text, Text, Text]:
        line = "".join(self.BLOCKS[round(share * (len(self.BLOCKS) - 1))] for share in self._history)
        bar = "█" * round(self.share() * bar_width)
        return Text(self.name, "bold"), Text(self.number(), "bold cyan"), Text(bar, "cyan"), Text(line, "blue")


def draw(traces: dict[int, Trace], width: int, started_s: float) -> Group:
    bar_width = width - NAME_WIDTH - TRACE_WIDTH - 10
    table = Table.grid(padding=(0, 1))
    table.add_column(width=NAME_WIDTH, no_wrap=True)
    table.add_column(width=4, justify="right")
    table.add_column(width=bar_width)
    table.add_column(width=TRACE_WIDTH)
    for trace in traces.values():
        table.add_row(*trace.row(bar_width))
    return Group(table, Text(f"{time.monotonic() - started_s:.1f} s; Ctrl-C ends", style="dim"))


def received(pdcpd: Pdcpd, device: Identity, until_s: float) -> Iterator[Value]:
    """Values that arrive at a device, until a time. Fails when pdcpd has ended or nothing comes any more."""
    last_s = time.monotonic()
    while (now_s := time.monotonic()) < until_s:
        try:
            value = pdcpd.values.get(timeout=min(0.1, until_s - now_s))
        except queue.Empty:
            if pdcpd.has_ended():
                raise pdcpd.ended_error() from None
            if now_s - last_s > SILENCE_S:
                raise DemoError(f"nothing has arrived at {device} for {SILENCE_S:g} s") from None
            continue
        if value.device == device:
            last_s = now_s
            yield value


def traced(values: Iterator[Value], traces: dict[int, Trace]) -> Iterator[Value]:
    """Hands the values on, and shows each to its trace."""
    for value in values:
        if value.channel in traces:
            traces[value.channel].value = value.value
        yield value


def with_live_view(values: Iterator[Value], traces: dict[int, Trace], console: Console) -> Values:
    """Hands the values on while two lines of the terminal follow them."""
    started_s = time.monotonic()
    step_s = started_s
    view = Live(console=console, refresh_per_second=20,
                get_renderable=lambda: draw(traces, console.width, started_s))
    with view:
        for value in traced(values, traces):
            if time.monotonic() >= step_s:
                step_s += STEP_S
                for trace in traces.values():
                    trace.step()
            yield value


def with_plain_lines(values: Iterator[Value], traces: dict[int, Trace], console: Console) -> Values:
    """Hands the values on and prints a line of them now and then."""
    started_s = time.monotonic()
    next_s = started_s
    for value in traced(values, traces):
        now_s = time.monotonic()
        if now_s >= next_s and all(trace.value is not None for trace in traces.values()):
            next_s += PLAIN_EVERY_S
            shown = "   ".join(f"{trace.name} {trace.number():>3}" for trace in traces.values())
            console.print(f"{now_s - started_s:5.1f} s   {shown}")
        yield value


# --- the check of --once ---


def spread_ms(sine: Sine, start_ms: int, values: list[Value]) -> float:
    """How unevenly these values follow the sine from start_ms on: how far the times that they took to arrive differ,
    the latest few aside. Infinite: they are not its values in this order."""
    phase_ms = start_ms
    times_ms = []
    for value in values:
        gone_ms = value.time_ms - values[0].time_ms
        while value.value is None or abs(sine.at(phase_ms) - value.value) > ROUNDING:
            phase_ms += 1
            if phase_ms - start_ms > gone_ms + LATE_MS:
                return math.inf
        times_ms.append(gone_ms - (phase_ms - start_ms))
    times_ms.sort()
    return times_ms[round(len(times_ms) * (1 - LATE_SHARE)) - 1] - times_ms[0]


def follows(sine: Sine, values: list[Value]) -> bool:
    """Are these the sine's values, in their order and about as fast?

    When they came does not matter much: the sensor is another process, which a busy machine lets wait.
    """
    starts_ms = (ms for ms in range(sine.period_ms) if abs(sine.at(ms) - (values[0].value or 0)) <= ROUNDING)
    return any(spread_ms(sine, start_ms, values) <= LATE_MS for start_ms in starts_ms)


def agree(wrist_and_grip: list[Value]) -> bool:
    """Is the grip closed when the wrist is in the upper half? Both are made of the same muscle signal, one after the
    other, so that the wrist's value just before or just after a grip's tells."""
    wrist = [int(value.channel == WRIST and (value.value or 0) > FULL_RANGE / 2) for value in wrist_and_grip]
    at = [i for i, value in enumerate(wrist_and_grip) if value.channel == WRIST]
    before = at[0]
    for i, value in enumerate(wrist_and_grip):
        if value.channel == WRIST:
            before = i
        elif at[0] < i < at[-1]:
            after = next(k for k in at if k > i)
            if value.value not in (wrist[before], wrist[after]):
                return False
    return True


def check_values(sine: Sine, values: list[Value]) -> str:
    """Says what is wrong with the values of both inputs; an empty text: they are those that the sine sends."""
    wrist = [value for value in values if value.channel == WRIST]
    grip = [value for value in values if value.channel == GRIP]
    for name, channel in (("wrist", wrist), ("grip", grip)):
        if len(channel) < ENOUGH:
            return f"only {len(channel)} of {ENOUGH} values arrived at the {name}"
        if any(value.safe for value in channel):
            return f"the {name} went to its safe value"
        if len({value.value for value in channel}) < 2:
            return f"the {name} received the same value all the time"
    if any(value.value is None or not sine.low <= value.value <= sine.high for value in wrist):
        return f"a value at the wrist is not between {sine.low} and {sine.high}"
    if not follows(sine, wrist) or not agree([value for value in values if value.channel in (WRIST, GRIP)]):
        return f"the values are not those of a sine from {sine.low} to {sine.high} in {sine.period_ms} ms"
    return ""


# --- the whole ---


def show_limb(limb: Limb, console: Console) -> Names:
    """Waits for the links and prints what there is."""
    with Client(limb.pdcpd.port()) as host:
        wait_for_links(host)
        names = read_names(host)
        console.print()
        for table in (device_table(host, names), link_table(host, names)):
            console.print(table)
    return names


def show_values(limb: Limb, names: Names, console: Console, for_s: float,
                is_enough: Callable[[deque[Value]], bool] = lambda _: False) -> deque[Value]:
    """Shows what arrives at the hand, for so long or until it is enough, and returns it."""
    traces = {
        channel: Trace(names.descriptors[ChannelId(limb.hand, channel)], highest)
        for channel, highest in ((WRIST, FULL_RANGE), (GRIP, 1))
    }
    console.print(f"[bold]What arrives at {names.descriptors[ChannelId(limb.hand)]}[/bold]")
    limb.drop_old()
    values = received(limb.pdcpd, limb.hand, time.monotonic() + for_s)
    show = with_live_view if console.is_terminal else with_plain_lines
    kept: deque[Value] = deque(maxlen=KEPT_MAX)
    with closing(show(values, traces, console)) as shown:
        for value in shown:
            kept.append(value)
            if is_enough(kept):
                break
    return kept


def next_value(limb: Limb, safe: bool) -> None:
    """Waits for a value at the hand, or for its safe value."""
    until_s = time.monotonic() + SETUP_TIMEOUT_S
    while True:
        try:
            value = limb.pdcpd.values.get(timeout=max(0.0, min(0.1, until_s - time.monotonic())))
        except queue.Empty:
            if limb.pdcpd.has_ended():
                raise limb.pdcpd.ended_error() from None
            if time.monotonic() >= until_s:
                what = "its safe value" if safe else "a value"
                raise DemoError(f"{limb.hand} has not had {what} for {SETUP_TIMEOUT_S:g} s") from None
            continue
        if value.device == limb.hand and value.safe == safe:
            return


def swap_sensor(limb: Limb, sensor: Program, console: Console) -> None:
    """The sensor is pulled; a while later another one is plugged in."""
    console.print("\n[bold]The sensor is pulled.[/bold]")
    started_s = time.monotonic()
    sensor.kill()
    next_value(limb, safe=True)
    missed_s = time.monotonic() - started_s
    console.print(f"After {missed_s:.1f} s, three beacons, it is missed: the hand goes to its safe values.")
    time.sleep(PULLED_S)
    limb.drop_old()
    console.print("[bold]A spare sensor of another kind is plugged in.[/bold]")
    started_s = time.monotonic()
    limb.plug(SPARE)
    next_value(limb, safe=False)
    took_ms = (time.monotonic() - started_s) * 1000
    console.print(f"{took_ms:.0f} ms after its power-on its values arrive at the hand; nobody asked for it.")


def await_sine(limb: Limb, sine: Sine, names: Names, console: Console) -> None:
    """Shows what arrives until the newest values are the sensor's sine. Fails when they never are."""
    fault = check_values(sine, [])

    def is_sine(kept: deque[Value]) -> bool:
        nonlocal fault
        if len(kept) >= JUDGED and len(kept) % JUDGED_STEP == 0:
            fault = check_values(sine, list(kept)[-JUDGED:])
        return not fault

    kept = show_values(limb, names, console, ONCE_LIMIT_S, is_sine)
    if fault:
        raise DemoError(check_values(sine, list(kept)[-JUDGED:]) or fault)
    console.print(f"[green]{len(kept)} values have arrived, and the newest are the sine that D1 sends.[/green]")


def run(limb: Limb, console: Console, once: bool) -> None:
    sine = read_sine(SENSOR)
    sensor = limb.plug(SENSOR)
    names = show_limb(limb, console)
    if once:
        await_sine(limb, sine, names, console)
    else:
        show_values(limb, names, console, BEFORE_SWAP_S)
    swap_sensor(limb, sensor, console)
    names = show_limb(limb, console)
    kept = show_values(limb, names, console, REPAIRED_ONCE_S if once else math.inf)
    if len({value.value for value in kept if value.channel == WRIST}) < 2:
        raise DemoError("the spare sensor's values do not arrive")
    console.print("[green]The limb has repaired itself.[/green]")


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong."""

    def error(self, message: str) -> NoReturn:
        sys.stderr.write(f"demo: {message}; --help tells more\n")
        sys.exit(2)


def parse_arguments(arguments: list[str]) -> argparse.Namespace:
    parser = Parser(prog="tools/demo", description="A limb of three simulated devices that links and repairs itself.")
    parser.add_argument("--once", action="store_true", help="end after 6 s, later on a busy machine, with exit status "
                        "0 only if the sine of D1 arrived at both inputs of D3, and after the swap that of D4")
    parser.add_argument("--bin", type=Path, default=Path("build/default/bin"), metavar="FOLDER",
                        help="where pdcpd is (default: %(default)s)")
    return parser.parse_args(arguments)


def leave(number: int, _frame: object) -> NoReturn:
    """SIGTERM and SIGHUP end the program the way Ctrl-C does: through its finally clauses."""
    raise SystemExit(128 + number)


def demonstrate(options: argparse.Namespace) -> None:
    console = Console(highlight=False)
    console.width = max(WIDTH_MIN, min(WIDTH, console.width)) if console.is_terminal else WIDTH
    with ExitStack() as stack:
        limb = Limb(options.bin, stack)
        try:
            run(limb, console, options.once)
        except BrokenPipeError:
            raise
        except ConnectionFailedError as error:
            if limb.pdcpd.ends():
                raise limb.pdcpd.ended_error() from error
            raise
        except (OSError, PdcpError) as error:
            if limb.pdcpd.has_ended():
                raise limb.pdcpd.ended_error() from error
            raise


def main() -> int:
    options = parse_arguments(sys.argv[1:])
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, leave)
    try:
        demonstrate(options)
    except KeyboardInterrupt:
        return 130 if options.once else 0
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the interpreter flushes it at its end
        return 1
    except (DemoError, EndedError, PdcpError, OSError) as error:
        sys.stderr.write(f"demo: {error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
