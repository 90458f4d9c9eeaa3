"""The commands that look at the CAN bus itself: dump, busload, record, replay, and the words of profiles."""

import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated, TextIO

import can
import typer
from rich.live import Live
from rich.table import Table

from ..busload import BusLoad, Summary, Window
from ..candump import format_frame
from ..capture import is_sendable, open_bus, open_frames, play, read_bus, to_message
from ..decode import Decoder, format_line, to_json
from ..frames import Frame
from ..profiles import Profile, parse_profile, profile_name, profiles
from .common import (
    CommandError,
    JsonOption,
    Status,
    UsageFault,
    json_text,
    new_console,
    new_table,
    one_line,
    reason,
    show,
    waiting,
    wants_json,
)
from .consent import ForceOption, may_overwrite

COMPLAINTS_TOLD = 10  # of one file or bus
SEND_PATIENCE_S = 1.0  # a full transmit queue empties meanwhile

_FILE_HELP = "Log of candump -L, pcap or pcapng; - is standard input."
FileArgument = Annotated[str, typer.Argument(metavar="FILE", help=_FILE_HELP)]
InterfaceOption = Annotated[
    str, typer.Option("--interface", "-i", metavar="NAME", help="A bus of python-can, such as socketcan or socketcand.")
]
ChannelOption = Annotated[
    str, typer.Option("--channel", "-c", metavar="NAME", help="Its channel; socketcand: HOST:PORT/NAME.")
]
BusOption = Annotated[
    list[str] | None, typer.Option("--option", "-o", metavar="KEY=VALUE", help="More for python-can; repeatable.")
]
SecondsOption = Annotated[
    float | None, typer.Option("--seconds", min=0, metavar="S", help="Listen so long; else until Ctrl-C.")
]


class Complaints:
    """Tells on standard error what could not be read, and counts it."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, text: str) -> None:
        self.count += 1
        if self.count <= COMPLAINTS_TOLD:
            sys.stderr.write(f"pdcp: {one_line(text)}\n")
        elif self.count == COMPLAINTS_TOLD + 1:
            sys.stderr.write("pdcp: others like this are only counted\n")

    def check(self) -> None:
        if self.count:
            raise CommandError(f"{self.count} {'place' if self.count == 1 else 'places'} could not be read")


@contextmanager
def _bus(interface: str, channel: str, options: list[str] | None) -> Iterator[can.BusABC]:
    pairs = dict(option.partition("=")[::2] for option in options or [])
    where = " ".join((interface, channel)).strip()
    try:
        bus = open_bus(interface, channel, pairs)
    except (can.CanError, OSError, ValueError, TypeError, NotImplementedError, ImportError) as error:
        raise CommandError(f"{where}: {reason(error)}", Status.NO_CONNECTION) from error
    with bus:
        try:
            yield bus
        except can.CanError as error:
            raise CommandError(f"{where}: {reason(error)}", Status.NO_CONNECTION) from error


class Source:
    """Where frames come from: a file, or a bus until its time is up or Ctrl-C."""

    def __init__(
        self, file: str, interface: str, channel: str, options: list[str] | None, seconds: float | None
    ) -> None:
        if bool(file) == bool(interface):
            raise UsageFault("give either a file or --interface with its --channel")
        if seconds is not None and not interface:
            raise UsageFault("--seconds belongs to --interface")
        self.complaints = Complaints()
        self.is_live = bool(interface)
        self._file, self._interface, self._channel, self._options = file, interface, channel, options
        self._seconds = seconds

    def frames(self) -> Iterator[Frame | None]:
        """The frames; on a bus None now and then while there are none."""
        if not self.is_live:
            with _open_file(self._file, self.complaints) as frames:
                yield from frames
            return
        with _bus(self._interface, self._channel, self._options) as bus:
            end_s = None if self._seconds is None else time.monotonic() + self._seconds
            try:
                yield from read_bus(bus, _log_name(self._channel), end_s, time.monotonic)
            except KeyboardInterrupt:
                return


@contextmanager
def _open_file(path: str, complaints: Complaints) -> Iterator[Iterator[Frame]]:
    with ExitStack() as stack:
        try:
            frames = stack.enter_context(open_frames(path, complaints))
        except OSError as error:
            raise UsageFault(f"{path}: {error.strerror}") from error
        yield frames


def _log_name(channel: str) -> str:
    """The interface as it stands in a log: one word, for socketcand the name of the bus."""
    name = channel.rpartition("/")[2] if ":" in channel else channel
    return "_".join(name.split()) or "can0"


# --- dump -----------------------------------------------------------------------------------------


def dump(
    ctx: typer.Context,
    file: FileArgument = "",
    interface: InterfaceOption = "",
    channel: ChannelOption = "",
    option: BusOption = None,
    seconds: SecondsOption = None,
    learn: Annotated[
        list[str] | None, typer.Option("--learn", metavar="FILE", help="Read this first, without output; repeatable.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Say what the frames of a log, a capture or a bus mean, one line a frame. A line holds the time, the identifier,
    who speaks to whom (BA is the arbitrator), the message and its fields. Node ids, types, profiles and raw bytes
    are hexadecimal, all else is decimal. Behind ! stands what is wrong with a frame. With --json a line is an object.
    """
    source = Source(file, interface, channel, option, seconds)
    decoder = Decoder()
    for path in learn or []:
        with _open_file(path, source.complaints) as earlier:
            for known in earlier:
                decoder.decode(known)
    objects = wants_json(ctx, as_json)
    for frame in source.frames():
        if frame is not None:
            decoded = decoder.decode(frame)
            line = json_text(to_json(decoded)) if objects else format_line(decoded)
            sys.stdout.write(line + "\n")
        if source.is_live:
            sys.stdout.flush()
    source.complaints.check()


# --- busload --------------------------------------------------------------------------------------


def _percent(load: float) -> str:
    return f"{100 * load:.2f}"


def _senders_table(load: BusLoad) -> Table:
    table = new_table("Bus load at 1 Mbit/s")
    table.add_column("sender", overflow="fold")
    for name in ("frames", "bits", "mean %", "peak %"):
        table.add_column(name, justify="right", no_wrap=True)
    total = load.total()
    for row in [*load.senders(), total]:
        table.add_row(
            row.sender,
            str(row.frames),
            str(row.bits),
            _percent(row.mean),
            _percent(row.peak),
            style="bold" if row is total else None,
        )
    return table


def _windows_table(load: BusLoad) -> Table:
    table = new_table("By time")
    for name in ("from, s", "frames", "bits", "load %"):
        table.add_column(name, justify="right", no_wrap=True)
    for window in load.windows():
        count = window.total
        table.add_row(
            f"{window.start_us / 1_000_000:.6f}", str(count.frames), str(count.bits), _percent(load.load(count))
        )
    return table


def _summary_json(row: Summary) -> dict[str, object]:
    return {"sender": row.sender, "frames": row.frames, "bits": row.bits, "mean": row.mean, "peak": row.peak}


def _window_json(load: BusLoad, window: Window) -> dict[str, object]:
    return {
        "start": window.start_us / 1_000_000,
        "frames": window.total.frames,
        "bits": window.total.bits,
        "load": load.load(window.total),
        "senders": {sender: load.load(count) for sender, count in sorted(window.senders.items())},
    }


def _count(source: Source, load: BusLoad, live: Live | None, interval_s: float) -> None:
    decoder = Decoder()
    refresh_s = time.monotonic() + interval_s
    for frame in source.frames():
        if frame is not None:
            decoder.decode(frame)
            load.add(frame, decoder.sender(frame))
        if live is not None and time.monotonic() >= refresh_s:
            refresh_s += interval_s
            live.update(_senders_table(load), refresh=True)


def busload(
    ctx: typer.Context,
    file: FileArgument = "",
    interface: InterfaceOption = "",
    channel: ChannelOption = "",
    option: BusOption = None,
    seconds: SecondsOption = None,
    interval: Annotated[float, typer.Option("--interval", min=0.001, metavar="S", help="Length of a window.")] = 1.0,
    windows: Annotated[bool, typer.Option("--windows", help="Show every window, too.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Count how much of the bus everybody takes: exact bits at 1 Mbit/s, stuff bits and interframe space included. The
    mean is that over all windows from the first frame to the last, the peak that of the fullest window. A device is
    named by its identity from the moment that it binds.
    """
    source = Source(file, interface, channel, option, seconds)
    load = BusLoad(round(interval * 1_000_000))
    objects = wants_json(ctx, as_json)
    console = new_console()
    if source.is_live and console.is_terminal and not objects:
        with Live(console=console, auto_refresh=False, transient=True) as live:
            _count(source, load, live, interval)
    else:
        _count(source, load, None, interval)
    data = {
        "interval": interval,
        "total": _summary_json(load.total()),
        "senders": [_summary_json(row) for row in load.senders()],
        "uncounted": load.uncounted,
        **({"windows": [_window_json(load, window) for window in load.windows()]} if windows else {}),
    }
    show(ctx, as_json, data, _senders_table(load), *([_windows_table(load)] if windows else []))
    if load.uncounted and not objects:
        console.print(f"CAN FD frames, not counted: {load.uncounted}")
    source.complaints.check()


# --- record and replay ----------------------------------------------------------------------------


@contextmanager
def _open_output(path: str, force: bool) -> Iterator[TextIO]:
    if path == "-":
        yield sys.stdout
        return
    may_overwrite(path, force)
    with ExitStack() as stack:
        try:
            stream = stack.enter_context(Path(path).open("w", encoding="ascii", errors="replace"))
        except OSError as error:
            raise UsageFault(f"{path}: {error.strerror}") from error
        yield stream


def record(
    file: Annotated[str, typer.Argument(metavar="FILE", help="Where the log goes; - is standard output.")],
    interface: InterfaceOption,
    channel: ChannelOption = "",
    option: BusOption = None,
    seconds: SecondsOption = None,
    force: ForceOption = False,
) -> None:
    """Write what is on a bus to a log, in the format of candump -L."""
    source = Source("", interface, channel, option, seconds)
    count = 0
    with _open_output(file, force) as output:
        for frame in source.frames():
            if frame is None:
                output.flush()
            else:
                output.write(format_frame(frame) + "\n")
                count += 1
    sys.stderr.write(f"{count} frames\n")


def _send(bus: can.BusABC, frame: Frame) -> None:
    """Sends a frame; a full queue has a while to become empty."""
    end_s = time.monotonic() + SEND_PATIENCE_S
    while True:
        try:
            bus.send(to_message(frame), timeout=SEND_PATIENCE_S)
            return
        except can.CanOperationError:
            if time.monotonic() >= end_s:
                raise
            time.sleep(0.001)


def replay(
    file: Annotated[str, typer.Argument(metavar="FILE", help=_FILE_HELP)],
    interface: InterfaceOption,
    channel: ChannelOption = "",
    option: BusOption = None,
    speed: Annotated[float, typer.Option("--speed", min=0.001, metavar="X", help="2 is twice as fast.")] = 1.0,
    no_wait: Annotated[bool, typer.Option("--no-wait", help="Send as fast as the bus takes it.")] = False,
) -> None:
    """Send the frames of a log to a bus, with the times between them. All frames are sent, whoever sent them before.
    What the bus cannot carry is passed over and told: error frames, CAN FD where it is not switched on, and remote
    frames over socketcand.
    """
    complaints = Complaints()
    with _open_file(file, complaints) as found:
        frames = list(found)
    with _bus(interface, channel, option) as bus:
        sound = []
        for frame in frames:
            if is_sendable(bus, interface, frame):
                sound.append(frame)
            else:
                kind = "CAN FD" if frame.fd else frame.kind
                complaints(f"{file}: the {kind} frame at {frame.time_us / 1_000_000:.6f} s cannot be sent")
        with waiting("replay", len(sound)) as step:

            def send(frame: Frame) -> None:
                _send(bus, frame)
                step()

            play(sound, send, None if no_wait else speed)
    sys.stderr.write(f"{len(sound)} frames\n")
    complaints.check()


# --- profiles -------------------------------------------------------------------------------------


def _profile_json(node: Profile) -> dict[str, object]:
    return {key: getattr(node, key) for key in Profile.__dataclass_fields__}


def _tree_table(nodes: list[Profile]) -> Table:
    table = new_table("Profiles")
    for name in ("word", "path", "name", "value"):
        table.add_column(name, no_wrap=name == "word", overflow="fold")
    for node in nodes:
        table.add_row(f"{node.word:04X}h", node.path, node.name, node.means)
    return table


def _profile_table(node: Profile, word: int) -> Table:
    table = new_table(f"{word:04X}h {profile_name(word)}")
    table.add_column("requirement", no_wrap=True)
    table.add_column("")
    for name, text in (
        ("path", node.path),
        ("value", node.means),
        ("scale", node.scale),
        ("control mode", node.mode),
        ("sign", node.sign),
        ("frames a second", node.rate),
        ("safe value", node.safe),
    ):
        table.add_row(name, text)
    return table


def list_profiles(
    ctx: typer.Context,
    profile: Annotated[str, typer.Argument(metavar="PROFILE", help="A path or a word, such as 2220h.")] = "",
    as_json: JsonOption = False,
) -> None:
    """Show the reference tree of channel profiles, or what one of them requires."""
    if not profile:
        nodes = list(profiles().values())
        show(ctx, as_json, [_profile_json(node) for node in nodes], _tree_table(nodes))
        return
    try:
        word = parse_profile(profile)
    except ValueError as error:
        raise UsageFault(str(error)) from error
    known = [node for node in profiles().values() if _is_ancestor(node.word, word)]
    if not known:
        raise UsageFault(f"{word:04X}h is not within the tree")
    show(ctx, as_json, _profile_json(known[-1]), _profile_table(known[-1], word))


def _is_ancestor(node: int, word: int) -> bool:
    """Is the node the word itself or above it in the tree?"""
    masks = (0xF000, 0xFF00, 0xFFF0, 0xFFFF)
    return any(word & mask == node for mask in masks)


def register(app: typer.Typer) -> None:
    app.command("dump")(dump)
    app.command("busload")(busload)
    app.command("record")(record)
    app.command("replay")(replay)
    app.command("profiles")(list_profiles)
