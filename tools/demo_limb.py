#!/usr/bin/env python3
"""The demonstration behind tools/demo: pdcpd with three simulated devices, linked through the host API.

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
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, NoReturn

import hostapi
from hostapi import Channel, Host, Identity
from programs import EndedError, Pdcpd, Value, until
from rich import box
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

FOLDER = Path(__file__).resolve().parent / "demo.d"
FILES = [FOLDER / "d1.ini", FOLDER / "d2.ini", FOLDER / "d3.ini"]
# (device, channel) of the output and of the input; devices count from 0 as in FILES.
LINKS = [((0, 1), (1, 2)), ((1, 3), (2, 1)), ((1, 5), (2, 2))]
WRIST, GRIP = 1, 2  # the terminal inputs of the third device

WIDTH = 88
WIDTH_MIN = 60
NAME_WIDTH = 13
TRACE_WIDTH = 30
STEP_S = 0.05  # of a trace
SETUP_TIMEOUT_S = 15.0
ONCE_S = 2.0
SILENCE_S = 2.0  # without a value: the demonstration has failed
PLAIN_EVERY_S = 0.2
FULL_RANGE = 255  # of the 8-bit channels that the sine passes through

DEVICE_DESCRIPTOR = 7
DEVICE_NODE_ID = 8
CHANNEL_DESCRIPTOR = 2
OUTPUT_NODE_ID = 5

TYPE_SIZES = ("4bit", "8bit", "12bit", "16bit")
TYPE_DATA = ("signed", "unsigned", "float", "boolean")
TYPE_CONTROL = ("position", "velocity", "acceleration", "other")


class DemoError(Exception):
    """The demonstration cannot go on; the text says why."""


class Device(NamedTuple):
    """What the demonstration knows of a device before it asks: its description file."""

    identity: Identity
    channels: int
    signal: str  # of its first channel


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
    """Descriptors and node ids, as the devices themselves tell them; number 0 is the device."""

    descriptors: dict[Channel, str]
    node_ids: dict[Channel, int]


def parse_ini(path: Path) -> configparser.ConfigParser:
    parser = configparser.ConfigParser(inline_comment_prefixes=(";",), interpolation=None)
    with path.open(encoding="utf-8") as file:
        parser.read_file(file)
    return parser


def read_device(path: Path) -> Device:
    ini = parse_ini(path)
    identity = Identity(*(int(ini["device"][key], 0) for key in ("vid", "pid", "serial")))
    channels = sum(name.startswith("channel ") for name in ini.sections())
    return Device(identity, channels, ini["channel 1"].get("signal", ""))


def read_sine(path: Path) -> Sine:
    channel = parse_ini(path)["channel 1"]
    words = channel.get("signal", "").split()
    if len(words) != 4 or words[0] != "sine":
        raise DemoError(f"{path.name}: the signal of channel 1 is no sine; --once cannot check it")
    return Sine(int(words[1]), int(words[2]), int(words[3]), channel.getint("rate_ms", 100))


# --- the limb ---


def wait_for_setup(host: Host, devices: list[Device]) -> None:
    channels = sum(device.channels for device in devices)

    def is_set_up() -> bool:
        info = host.system_info()
        return info.devices == len(devices) and info.inputs + info.outputs == channels

    until(is_set_up, f"{len(devices)} devices with {channels} channels are set up", SETUP_TIMEOUT_S)


def make_links(host: Host, devices: list[Device]) -> None:
    for (from_device, output), (to_device, input_) in LINKS:
        source = Channel(devices[from_device].identity, output)
        target = Channel(devices[to_device].identity, input_)
        if host.configure_link(source, target) != hostapi.LINK_ACTIVE:
            raise DemoError(f"the link from {source} to {target} is not active")


def read_names(host: Host) -> Names:
    descriptors: dict[Channel, str] = {}
    node_ids: dict[Channel, int] = {}
    for info in host.devices():
        descriptors[info.channel] = host.get_parameter(info.channel, DEVICE_DESCRIPTOR).decode(errors="replace")
        node_ids[info.channel] = host.get_parameter(info.channel, DEVICE_NODE_ID)[0]
    for info in host.inputs():
        descriptors[info.channel] = host.get_parameter(info.channel, CHANNEL_DESCRIPTOR).decode(errors="replace")
    for info in host.outputs():
        descriptors[info.channel] = host.get_parameter(info.channel, CHANNEL_DESCRIPTOR).decode(errors="replace")
        node_ids[info.channel] = host.get_parameter(info.channel, OUTPUT_NODE_ID)[0]
    return Names(descriptors, node_ids)


# --- tables ---


def type_text(word: int) -> str:
    """A channel type in words (profile-layer.md 2: bit 0 is the most significant)."""
    words = [TYPE_SIZES[word >> 14], TYPE_DATA[word >> 12 & 3], TYPE_CONTROL[word >> 10 & 3]]
    words += ["sole"] if word >> 9 & 1 else []
    words += ["terminal"] if word >> 8 & 1 else []
    return " ".join(words)


def new_table(title: str) -> Table:
    return Table(
        title=title,
        title_style="bold",
        title_justify="left",
        header_style="dim",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )


def device_table(host: Host, names: Names) -> Table:
    table = new_table("Devices")
    table.add_column("device", style="bold")
    table.add_column("VID:PID:SN")
    table.add_column("node id", justify="right")
    table.add_column("inputs", justify="right")
    table.add_column("outputs", justify="right")
    inputs, outputs = host.inputs(), host.outputs()
    for info in sorted(host.devices()):
        device = info.channel.device
        counts = [str(sum(each.channel.device == device for each in channels)) for channels in (inputs, outputs)]
        table.add_row(names.descriptors[info.channel], str(device), str(names.node_ids[info.channel]), *counts)
    return table


def channel_table(host: Host, names: Names) -> Table:
    table = new_table("Channels")
    table.add_column("device", style="bold")
    table.add_column("channel")
    table.add_column("", no_wrap=True)
    table.add_column("type")
    table.add_column("profile", justify="right")
    table.add_column("id", justify="right")
    rows = sorted([(info, "in") for info in host.inputs()] + [(info, "out") for info in host.outputs()])
    last = None
    for info, direction in rows:
        device = Channel(info.channel.device, 0)
        table.add_row(
            names.descriptors[device] if device != last else "",
            f"{info.channel.number} {names.descriptors[info.channel]}",
            direction,
            type_text(info.type),
            f"{info.profile:04X}h",
            str(names.node_ids.get(info.channel, "")),
        )
        last = device
    return table


def link_table(host: Host, names: Names) -> Table:
    def text(channel: Channel) -> str:
        return f"{names.descriptors[Channel(channel.device, 0)]}, {channel.number} {names.descriptors[channel]}"

    table = new_table("Links")
    table.add_column("from")
    table.add_column("")
    table.add_column("to")
    table.add_column("status")
    for link in sorted(host.links()):
        active = link.status == hostapi.LINK_ACTIVE
        status = Text("active", style="green") if active else Text("inactive", style="red")
        table.add_row(text(link.output), "→", text(link.input), status)
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
        if value.device == str(device):
            last_s = now_s
            yield value


def traced(values: Iterator[Value], traces: dict[int, Trace]) -> Iterator[Value]:
    """Hands the values on, and shows each to its trace."""
    for value in values:
        if value.channel in traces:
            traces[value.channel].value = value.value
        yield value


def with_live_view(values: Iterator[Value], traces: dict[int, Trace], console: Console) -> Iterator[Value]:
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


def with_plain_lines(values: Iterator[Value], traces: dict[int, Trace], console: Console) -> Iterator[Value]:
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


def matches(sine: Sine, shift_ms: int, wrist: list[Value], grip: list[Value]) -> bool:
    """Are these the sine's values, sent shift_ms into it when the clock was at 0?"""
    # Steps of a millisecond, and one for the time on the bus; rounding.
    slope = (sine.high - sine.low) * math.pi / sine.period_ms
    tolerance = 3 * slope + 1

    def wrong(value: Value) -> bool:
        expected = sine.at(value.time_ms + shift_ms)
        if value.channel == WRIST:
            return value.value is None or abs(value.value - expected) > tolerance
        near = abs(expected - FULL_RANGE / 2) <= tolerance
        return value.value not in (0, 1) or (not near and value.value != round(expected / FULL_RANGE))

    return not any(wrong(value) for value in wrist) and not any(wrong(value) for value in grip)


def check_values(sine: Sine, values: list[Value]) -> str:
    """Says what is wrong with the values of both inputs; an empty text: they are those that the sine sends."""
    wrist = [value for value in values if value.channel == WRIST]
    grip = [value for value in values if value.channel == GRIP]
    expected = round(ONCE_S * 1000 / sine.rate_ms)
    for name, channel in (("wrist", wrist), ("grip", grip)):
        if len(channel) < expected * 3 // 4:
            return f"only {len(channel)} of about {expected} values arrived at the {name}"
        if any(value.safe for value in channel):
            return f"the {name} went to its safe value"
        if len({value.value for value in channel}) < 2:
            return f"the {name} received the same value all the time"
    if any(value.value is None or not sine.low <= value.value <= sine.high for value in wrist):
        return f"a value at the wrist is not between {sine.low} and {sine.high}"
    if not any(matches(sine, shift_ms, wrist, grip) for shift_ms in range(sine.period_ms)):
        return f"the values are not those of a sine from {sine.low} to {sine.high} in {sine.period_ms} ms"
    return ""


# --- the whole ---


def build_limb(port: str, devices: list[Device], console: Console) -> Names:
    """Waits for the devices, links them and prints what there is."""
    with Host(port) as host:
        wait_for_setup(host, devices)
        make_links(host, devices)
        names = read_names(host)
        console.print()
        for table in (device_table(host, names), channel_table(host, names), link_table(host, names)):
            console.print(table)
    return names


def drop_old(pdcpd: Pdcpd) -> None:
    """Forgets the values that came before this moment."""
    while not pdcpd.values.empty():
        pdcpd.values.get()


def run(pdcpd: Pdcpd, console: Console, once: bool) -> None:
    devices = [read_device(path) for path in FILES]
    sine = read_sine(FILES[0]) if once else None
    hand = devices[2].identity
    names = build_limb(pdcpd.port(), devices, console)
    traces = {
        channel: Trace(names.descriptors[Channel(hand, channel)], highest)
        for channel, highest in ((WRIST, FULL_RANGE), (GRIP, 1))
    }
    console.print(f"[bold]What arrives at {names.descriptors[Channel(hand, 0)]}[/bold]")
    drop_old(pdcpd)
    values = received(pdcpd, hand, time.monotonic() + ONCE_S if once else math.inf)
    show = with_live_view if console.is_terminal else with_plain_lines
    shown = show(values, traces, console)
    if sine is None:
        for _ in shown:
            pass
        return
    kept = list(shown)
    fault = check_values(sine, kept)
    if fault:
        raise DemoError(fault)
    console.print(f"[green]{len(kept)} values arrived at both inputs, and they are the sine that D1 sends.[/green]")


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong."""

    def error(self, message: str) -> NoReturn:
        sys.stderr.write(f"demo: {message}; --help tells more\n")
        sys.exit(2)


def parse_arguments(arguments: list[str]) -> argparse.Namespace:
    parser = Parser(prog="tools/demo", description="A limb of three simulated devices, linked through the host API.")
    parser.add_argument("--once", action="store_true", help="end after 2 s, with exit status 0 only if D1's sine "
                        "arrived at both inputs of D3")
    parser.add_argument("--bin", type=Path, default=Path("build/default/bin"), metavar="FOLDER",
                        help="where pdcpd is (default: %(default)s)")
    return parser.parse_args(arguments)


def leave(number: int, _frame: object) -> NoReturn:
    """SIGTERM and SIGHUP end the program the way Ctrl-C does: through its finally clauses."""
    raise SystemExit(128 + number)


def demonstrate(options: argparse.Namespace) -> None:
    console = Console(highlight=False)
    console.width = max(WIDTH_MIN, min(WIDTH, console.width)) if console.is_terminal else WIDTH
    nodes = [word for path in FILES for word in ("--node", path)]
    with Pdcpd(options.bin, "--can", "sim", "--host", "pty", "--no-autoconfig", *nodes) as pdcpd:
        try:
            run(pdcpd, console, options.once)
        except BrokenPipeError:
            raise
        except (OSError, hostapi.HostError) as error:
            if pdcpd.has_ended():
                raise pdcpd.ended_error() from error
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
    except (DemoError, EndedError, hostapi.HostError, OSError) as error:
        sys.stderr.write(f"demo: {error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
