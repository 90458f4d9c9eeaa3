"""The command watch: what happens on the bus, as it happens."""

import json
import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from typing import Annotated

import typer
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from ..client import Client
from ..errors import PdcpError
from ..events import (
    ALL_KINDS,
    QUIET_KINDS,
    AuditDifference,
    BusState,
    BusStateChanged,
    CanFrame,
    ConfigurationChanged,
    DeviceBound,
    DeviceLost,
    Event,
    LinkChanged,
    UnknownEvent,
)
from ..model import LinkStatus, SystemInfo
from .common import Json, JsonOption, connect, new_console, new_table, settings, wants_json
from .tables import STATUS_STYLES

LINES_KEPT = 200
LINES_AROUND = 8  # of the live view that are no events
SLICE_S = 0.25

BUS_STYLES = {BusState.ACTIVE: "green", BusState.PASSIVE: "yellow", BusState.OFF: "red", BusState.SILENT: "yellow"}


def register(app: typer.Typer) -> None:
    app.command()(watch)


def describe(event: Event) -> tuple[str, str, str]:
    """What happened, to whom, and the style to show it in."""
    match event:
        case DeviceBound():
            return "device bound", f"{event.identity} as node {event.node_id}", "green"
        case DeviceLost():
            return "device lost", f"{event.identity}, node {event.node_id}", "red"
        case LinkChanged():
            word = "gone" if event.status is LinkStatus.GONE else event.status.name.lower()
            return f"link {word}", f"{event.output} → {event.input}", STATUS_STYLES[event.status]
        case ConfigurationChanged():
            active = f"number {event.active}" if event.active else "none"
            return "configuration", f"active: {active}, {event.stored} stored", "cyan"
        case CanFrame():
            return "frame", f"{event.can_id:03X}#{event.data.hex().upper()}", "dim"
        case BusStateChanged():
            errors = f"errors: {event.transmit_errors} transmitting, {event.receive_errors} receiving"
            return f"bus {event.state.name.lower()}", errors, BUS_STYLES[event.state]
        case AuditDifference():
            return "audit", f"{event.channel} had a wrong parameter {event.parameter}", "yellow"
        case UnknownEvent():
            return f"kind {event.kind}", event.data.hex(" "), "yellow"
    raise AssertionError(event)


def event_json(event: Event) -> Json:
    """One line of JSON for each event."""
    head: Json = {"time_ms": event.time_ms, "kind": event.kind}
    match event:
        case DeviceBound() | DeviceLost():
            name = "device_bound" if isinstance(event, DeviceBound) else "device_lost"
            return head | {"event": name, "id": str(event.identity), "node_id": event.node_id}
        case LinkChanged():
            ends = {"output": str(event.output), "input": str(event.input)}
            return head | {"event": "link_changed", **ends, "status": event.status.name.lower()}
        case ConfigurationChanged():
            return head | {"event": "configuration_changed", "active": event.active, "stored": event.stored}
        case CanFrame():
            return head | {"event": "can_frame", "can_id": event.can_id, "data": event.data.hex()}
        case BusStateChanged():
            errors = {"transmit_errors": event.transmit_errors, "receive_errors": event.receive_errors}
            return head | {"event": "bus_state", "state": event.state.name.lower(), **errors}
        case AuditDifference():
            return head | {"event": "audit", "channel": str(event.channel), "parameter": event.parameter}
        case UnknownEvent():
            return head | {"event": "unknown", "data": event.data.hex()}
    raise AssertionError(event)


def time_text(time_ms: int) -> str:
    return f"{time_ms / 1000:.3f}"


def received(client: Client, count: int | None, seconds: float | None) -> Iterator[Event | None]:
    """Events until so many have come or so much time has passed; None now and then."""
    end_s = None if seconds is None else time.monotonic() + seconds
    left = count
    while left is None or left > 0:
        wait_s = SLICE_S if end_s is None else min(SLICE_S, end_s - time.monotonic())
        if wait_s <= 0:
            return
        event = next(client.events(wait_s), None)
        if event is not None and left is not None:
            left -= 1
        yield event


class View:
    """The live view: a line about the limb, and the last events."""

    def __init__(self, client: Client, port: str | None) -> None:
        self._client = client
        self._port = port
        self._events: deque[Event] = deque(maxlen=LINES_KEPT)
        self._bus: BusState | None = None
        self._system: SystemInfo = client.system_info()

    def add(self, event: Event) -> None:
        self._events.append(event)
        if isinstance(event, BusStateChanged):
            self._bus = event.state
        elif not isinstance(event, CanFrame):
            self._system = self._client.system_info()

    def draw(self, console: Console) -> Group:
        system = self._system
        head = Text.assemble(
            (str(self._port), "bold"),
            f"   {system.devices} devices, {system.inputs} inputs, {system.outputs} outputs, {system.links} links   ",
            (f"bus {self._bus.name.lower()}", BUS_STYLES[self._bus]) if self._bus is not None else "",
        )
        rows = list(self._events)[-max(1, console.height - LINES_AROUND) :]
        body = _event_table(rows) if rows else Text("\nnothing has happened yet\n", "dim")
        return Group(head, body, Text("Ctrl-C ends", "dim"))


def _event_table(rows: list[Event]) -> Table:
    table = new_table()
    table.add_column("time", justify="right", style="dim", no_wrap=True)
    table.add_column("event", no_wrap=True, min_width=14)
    table.add_column("", min_width=40)
    for row in rows:
        what, whom, style = describe(row)
        table.add_row(time_text(row.time_ms), Text(what, style), Text(whom))
    return table


def _show_live(client: Client, port: str | None, events: Iterator[Event | None], console: Console) -> None:
    view = View(client, port)
    with Live(console=console, get_renderable=lambda: view.draw(console), refresh_per_second=10):
        for event in events:
            if event is not None:
                view.add(event)


def _show_lines(events: Iterator[Event | None]) -> None:
    for event in events:
        if event is not None:
            what, whom, _ = describe(event)
            sys.stdout.write(f"{time_text(event.time_ms):>10}  {what:<14}  {whom}\n")
            sys.stdout.flush()


def _show_json(events: Iterator[Event | None]) -> None:
    for event in events:
        if event is not None:
            sys.stdout.write(json.dumps(event_json(event)) + "\n")
            sys.stdout.flush()


def watch(
    ctx: typer.Context,
    frames: Annotated[bool, typer.Option("--frames", help="CAN frames too.")] = False,
    count: Annotated[
        int | None, typer.Option("--count", "-n", min=1, metavar="N", help="End after so many events.")
    ] = None,
    seconds: Annotated[float | None, typer.Option("--for", min=0, metavar="S", help="End after S seconds.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Follow what happens: devices, links, configurations, the bus. With --json one object a line."""
    kinds = ALL_KINDS if frames else QUIET_KINDS
    console = new_console()
    with connect(ctx) as client:
        client.stream(kinds)
        events = received(client, count, seconds)
        try:
            if wants_json(ctx, as_json):
                _show_json(events)
            elif console.is_terminal:
                _show_live(client, settings(ctx).port, events, console)
            else:
                _show_lines(events)
        except KeyboardInterrupt:
            pass  # the way to end it
        finally:
            with suppress(PdcpError):
                client.stream(())
