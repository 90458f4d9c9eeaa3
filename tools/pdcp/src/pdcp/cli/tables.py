"""Commands that show what there is: info, devices, inputs, outputs, links, print, stats."""

from collections.abc import Callable, Sequence
from typing import Annotated

import typer
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from .. import counters
from ..client import Client
from ..errors import ErrorCode, RequestError, UnknownMessageError
from ..model import ArbitratorInfo, Channel, ChannelId, Device, Direction, Flags, Link, LinkStatus, Stats, SystemInfo
from ..parameters import PARAMETERS, Kind, Parameter, kind_of, show_profile
from ..profiles import describe_type, profile_name
from .common import Json, JsonOption, UsageFault, connect, new_table, settings, show, waiting

NamesOption = Annotated[
    bool, typer.Option("--names/--no-names", help="Ask the devices for their descriptors, or show only the tables.")
]
DEVICE_DESCRIPTOR, CHANNEL_DESCRIPTOR = 7, 2

FLAG_NAMES = {
    Flags.AUTOCONFIGURE: "autoconfigure",
    Flags.HOT_SWAP: "hot-swap",
    Flags.AUTO_SAVE: "auto-save",
    Flags.STRICT_CRC: "strict-crc",
    Flags.EVENT_STREAM: "event-stream",
}
STATUS_STYLES = {LinkStatus.ACTIVE: "green", LinkStatus.INACTIVE: "red", LinkStatus.GONE: "dim"}


def register(app: typer.Typer) -> None:
    app.command()(info)
    app.command(name="print")(print_all)
    app.command()(devices)
    app.command()(inputs)
    app.command()(outputs)
    app.command()(links)
    app.command()(stats)


# --- names ---


class Names:
    """Descriptors, read when they are needed and kept. Devices that do not answer have none."""

    def __init__(self, client: Client | None) -> None:
        self._client = client
        self._known: dict[ChannelId, str | None] = {}

    def get(self, target: ChannelId) -> str | None:
        if self._client is None:
            return None
        if target not in self._known:
            number = CHANNEL_DESCRIPTOR if target.index else DEVICE_DESCRIPTOR
            try:
                value = self._client.get_parameter(target, number)
                self._known[target] = PARAMETERS[Kind.DEVICE][DEVICE_DESCRIPTOR - 1].show(value)
            except RequestError:
                self._known[target] = None
        return self._known[target]

    def text(self, target: ChannelId) -> str:
        return self.get(target) or ""

    def of_channel(self, channel: ChannelId) -> str:
        """Names of device and channel together."""
        return ", ".join(text for text in (self.text(ChannelId(channel.identity)), self.text(channel)) if text)


# --- JSON ---


def id_json(target: ChannelId) -> Json:
    data: Json = {"id": str(target), "vid": target.identity.vid, "pid": target.identity.pid, "sn": target.identity.sn}
    return data | {"index": target.index} if target.index else data


def device_json(device: Device, names: Names) -> Json:
    types = {"type": device.type, "profile": device.profile}
    return {"number": device.number, **id_json(device.id), "name": names.get(device.id), **types}


def channel_json(channel: Channel, names: Names) -> Json:
    return {
        "number": channel.number,
        "direction": str(channel.direction),
        **id_json(channel.id),
        "name": names.get(channel.id),
        "type": channel.type,
        "type_text": describe_type(channel.type),
        "profile": channel.profile,
        "profile_name": profile_name(channel.profile),
    }


def link_json(link: Link) -> Json:
    return {
        "number": link.number,
        "output": str(link.output),
        "input": str(link.input),
        "status": link.status.name.lower(),
    }


def arbitrator_json(found: ArbitratorInfo) -> Json:
    return {
        "protocol": found.protocol,
        "firmware": found.firmware_text,
        "limits": {
            "devices": found.limits.devices,
            "channels": found.limits.channels,
            "links": found.limits.links,
        },
        "profile_state": found.profile_state.name.lower(),
        "active_configuration": found.active,
        "stored_configurations": found.stored,
        "flags": {name: flag in found.flags for flag, name in FLAG_NAMES.items()},
    }


# --- tables ---


def number_text(number: int) -> str:
    return f"#{number}"


def word_text(word: int) -> str:
    return f"{word:04X}h"


def device_table(rows: Sequence[Device], names: Names) -> Table:
    table = new_table("Devices")
    table.add_column("#", justify="right", style="dim")
    table.add_column("device", style="bold", no_wrap=True)
    table.add_column("name")
    table.add_column("type", justify="right")
    table.add_column("profile", justify="right")
    for row in rows:
        table.add_row(
            str(row.number),
            str(row.identity),
            Text(names.text(row.id)),
            word_text(row.type),
            word_text(row.profile),
        )
    return table


def channel_table(title: str, rows: Sequence[Channel], names: Names) -> Table:
    table = new_table(title)
    table.add_column("#", justify="right", style="dim")
    table.add_column("channel", style="bold", no_wrap=True)
    table.add_column("name")
    table.add_column("type")
    table.add_column("profile")
    for row in rows:
        table.add_row(
            str(row.number),
            str(row.id),
            Text(names.of_channel(row.id)),
            describe_type(row.type),
            Text(show_profile(row.profile)),
        )
    return table


def link_table(rows: Sequence[Link], names: Names) -> Table:
    table = new_table("Links")
    table.add_column("#", justify="right", style="dim")
    table.add_column("output", style="bold", no_wrap=True)
    table.add_column("")
    table.add_column("")
    table.add_column("input", style="bold", no_wrap=True)
    table.add_column("")
    table.add_column("status")
    for row in rows:
        table.add_row(
            str(row.number),
            str(row.output),
            Text(names.of_channel(row.output)),
            "→",
            str(row.input),
            Text(names.of_channel(row.input)),
            Text(row.status.name.lower(), STATUS_STYLES[row.status]),
        )
    return table


def _pairs(title: str, rows: Sequence[tuple[str, str]]) -> Group:
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(style="dim")
    table.add_column()
    for name, value in rows:
        table.add_row(f" {name}", Text(value))
    return Group(Text(title, "bold"), table, "")


def info_table(system: SystemInfo, found: ArbitratorInfo | None) -> Group:
    counts = [
        ("devices", system.devices, found and found.limits.devices),
        ("channels", system.inputs + system.outputs, found and found.limits.channels),
        ("links", system.links, found and found.limits.links),
    ]
    rows = [(name, f"{count} of {limit}" if limit else str(count)) for name, count, limit in counts]
    rows[1] = (rows[1][0], f"{rows[1][1]} ({system.inputs} inputs, {system.outputs} outputs)")
    if found is None:
        rows.append(("extensions", "none: it knows only the messages 22xxh and 23xxh"))
        return _pairs("Arbitrator", rows)
    flags = [name for flag, name in FLAG_NAMES.items() if flag in found.flags]
    active = f"number {found.active}" if found.active else "none"
    rows += [
        ("protocol", str(found.protocol)),
        ("firmware", found.firmware_text),
        ("profile layer", found.profile_state.name.lower()),
        ("configurations", f"{found.stored} stored, active: {active}"),
        ("flags", ", ".join(flags) or "none"),
    ]
    return _pairs("Arbitrator", rows)


def stats_table(group: Stats) -> Table:
    table = new_table(f"Counters: {group.name}")
    table.add_column("counter", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("meaning", style="dim")
    for counter in group.counters:
        table.add_row(counter.name, str(counter.value), counter.text, style="" if counter.value else "dim")
    return table


# --- commands ---


def arbitrator_info(client: Client) -> ArbitratorInfo | None:
    """None: an arbitrator that has only the messages of the source."""
    try:
        return client.info()
    except UnknownMessageError:
        return None


def info(ctx: typer.Context, as_json: JsonOption = False) -> None:
    """Show the arbitrator: counts, limits, profile layer, flags."""
    with connect(ctx) as client:
        system = client.system_info()
        found = arbitrator_info(client)
    data: Json = {
        "port": settings(ctx).port,
        "devices": system.devices,
        "inputs": system.inputs,
        "outputs": system.outputs,
        "links": system.links,
        "arbitrator": arbitrator_json(found) if found else None,
    }
    show(ctx, as_json, data, info_table(system, found))


def devices(ctx: typer.Context, names: NamesOption = True, as_json: JsonOption = False) -> None:
    """List the devices."""
    with connect(ctx) as client, waiting("reading"):
        rows = client.devices()
        known = Names(client if names else None)
        data = [device_json(row, known) for row in rows]
        table = device_table(rows, known)
    show(ctx, as_json, data, table)


def _channels(ctx: typer.Context, direction: Direction, names: bool, as_json: bool) -> None:
    with connect(ctx) as client, waiting("reading"):
        rows = client.inputs() if direction is Direction.INPUT else client.outputs()
        known = Names(client if names else None)
        data = [channel_json(row, known) for row in rows]
        table = channel_table(f"{direction.title()}s", rows, known)
    show(ctx, as_json, data, table)


def inputs(ctx: typer.Context, names: NamesOption = True, as_json: JsonOption = False) -> None:
    """List the input channels."""
    _channels(ctx, Direction.INPUT, names, as_json)


def outputs(ctx: typer.Context, names: NamesOption = True, as_json: JsonOption = False) -> None:
    """List the output channels."""
    _channels(ctx, Direction.OUTPUT, names, as_json)


def links(ctx: typer.Context, names: NamesOption = True, as_json: JsonOption = False) -> None:
    """List the links, active and inactive."""
    with connect(ctx) as client, waiting("reading"):
        rows = client.links()
        table = link_table(rows, Names(client if names else None))
    show(ctx, as_json, [link_json(row) for row in rows], table)


def stats(
    ctx: typer.Context,
    group: Annotated[
        str | None,
        typer.Argument(metavar="GROUP", help="A group: bus, host, storage, drivers, or its number. Without: all."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show the arbitrator's counters since its start."""
    numbers = {each.name: number for number, each in enumerate(counters.GROUPS)}
    with connect(ctx) as client:
        if group is None:
            groups = client.all_stats()
        elif group in numbers or group.isdecimal() and int(group) <= 255:
            groups = [client.stats(numbers[group] if group in numbers else int(group))]
        else:
            raise UsageFault(f"'{group}' is no group of counters; there are {', '.join(numbers)}")
    data = [
        {
            "group": each.group,
            "name": each.name,
            "counters": [{"name": row.name, "value": row.value, "text": row.text} for row in each.counters],
        }
        for each in groups
    ]
    show(ctx, as_json, data, *(stats_table(each) for each in groups))


# --- print ---


Read = tuple[Parameter, bytes | None, str]  # value, or why there is none


def read_parameters(client: Client, target: ChannelId, kind: Kind, step: Callable[[], None]) -> list[Read]:
    """All parameters that this kind of thing may have. A target that nobody knows is refused with the first."""
    found: list[Read] = []
    for parameter in PARAMETERS[kind]:
        try:
            found.append((parameter, client.get_parameter(target, parameter.number), ""))
        except RequestError as error:
            if error.code in (ErrorCode.UNKNOWN_DEVICE, ErrorCode.UNKNOWN_CHANNEL):
                raise
            refused = error.code == ErrorCode.DEVICE_REFUSED
            found.append((parameter, None, "not supported" if refused else error.meaning))
        step()
    return found


def parameters_json(found: Sequence[Read]) -> list[Json]:
    return [parameter_json(parameter, value, fault) for parameter, value, fault in found]


def parameter_json(parameter: Parameter, value: bytes | None, fault: str = "") -> Json:
    head: Json = {"parameter": parameter.number, "name": parameter.name}
    if value is None:
        return head | {"error": fault}
    return head | {"value": parameter.decode(value), "text": parameter.show(value), "raw": value.hex()}


def parameter_grid(found: Sequence[Read], indent: int) -> Table:
    grid = Table.grid(padding=(0, 2, 0, 0))
    grid.add_column(width=indent + 2, justify="right", style="dim")
    grid.add_column(width=18, style="dim")
    grid.add_column()
    for parameter, value, fault in found:
        text = Text(parameter.show(value)) if value is not None else Text(fault, "dim italic")
        grid.add_row(str(parameter.number), parameter.name, text)
    return grid


def _heading(indent: int, *parts: tuple[str, str]) -> Text:
    text = Text(" " * indent)
    for part, style in parts:
        text.append(f"{part}  " if part else "", style)
    return text


def _print_channel(channel: Channel, found: Sequence[Read], names: Names) -> list[RenderableType]:
    short = "in" if channel.direction is Direction.INPUT else "out"
    head = _heading(
        3, (f"{short}#{channel.number}", "dim"), (str(channel.id), "bold cyan"), (names.text(channel.id), "bold")
    )
    return [head, parameter_grid(found, 6)]


def print_all(ctx: typer.Context, as_json: JsonOption = False) -> None:
    """Print everything: arbitrator, devices and channels with all parameters, links."""
    with connect(ctx) as client:
        system = client.system_info()
        found = arbitrator_info(client)
        device_rows, channel_rows = (client.devices(), [*client.inputs(), *client.outputs()])
        link_rows = client.links()
        names = Names(client)
        reads = [(row.id, Kind.DEVICE) for row in device_rows]
        reads += [(row.id, kind_of(row.direction)) for row in channel_rows]
        with waiting("reading parameters", sum(len(PARAMETERS[kind]) for _, kind in reads)) as step:
            read = {target: read_parameters(client, target, kind, step) for target, kind in reads}
            links_shown = link_table(link_rows, names)
            data, shown = _everything(device_rows, channel_rows, read, names)
    whole: Json = {
        "arbitrator": arbitrator_json(found) if found else None,
        "devices": data,
        "links": [link_json(row) for row in link_rows],
    }
    show(ctx, as_json, whole, info_table(system, found), *shown, links_shown)


def _everything(
    device_rows: Sequence[Device],
    channel_rows: Sequence[Channel],
    read: dict[ChannelId, list[Read]],
    names: Names,
) -> tuple[list[Json], list[RenderableType]]:
    """Devices with their channels, as JSON and to look at."""
    data: list[Json] = []
    shown: list[RenderableType] = []
    for device in device_rows:
        own = sorted((row for row in channel_rows if row.id.identity == device.identity), key=lambda row: row.id.index)
        channels = [channel_json(row, names) | {"parameters": parameters_json(read[row.id])} for row in own]
        parameters = parameters_json(read[device.id])
        data.append(device_json(device, names) | {"parameters": parameters, "channels": channels})
        shown.append(
            _heading(
                0,
                (number_text(device.number), "dim"),
                (str(device.identity), "bold cyan"),
                (names.text(device.id), "bold"),
            )
        )
        shown.append(parameter_grid(read[device.id], 3))
        for row in own:
            shown += _print_channel(row, read[row.id], names)
        shown.append("")
    return data, shown
