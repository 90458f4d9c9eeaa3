"""Commands that change links, configurations and what the profile layer does by itself."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from typing import Annotated

import typer
from rich.text import Text

from ..client import Client
from ..errors import ErrorCode, RequestError
from ..model import Action, Flags
from ..tlv import parse
from . import targets
from .common import CommandError, Json, JsonOption, about, connect, show, waiting
from .consent import DryRunOption, YesOption, consented, require
from .tables import STATUS_STYLES

NumberArgument = Annotated[
    int, typer.Argument(metavar="N", min=0, max=255, help="Number of the configuration; 0: the active one.")
]


TERMINAL = 0x0100  # in the type of a channel (profile-layer.md 2)


class Switch(StrEnum):
    ON = "on"
    OFF = "off"


class SwitchOrNow(StrEnum):
    ON = "on"
    OFF = "off"
    NOW = "now"


class FlagName(StrEnum):
    """Flags that can be switched."""

    AUTOCONFIGURE = "autoconfigure"
    HOT_SWAP = "hot-swap"
    AUTO_SAVE = "auto-save"
    STRICT_CRC = "strict-crc"


def register(app: typer.Typer) -> None:
    app.command(epilog=targets.EPILOG)(link)
    app.command(epilog=targets.EPILOG)(unlink)
    app.command()(clear)
    app.command()(enforce)
    app.command()(autoconfig)
    app.command()(replace)
    app.command()(adopt)
    app.command()(save)
    app.command()(load)
    app.command()(erase)
    app.command()(flag)


def link(
    ctx: typer.Context,
    output: Annotated[str, typer.Argument(metavar="OUTPUT", help=targets.OUTPUT_HELP)],
    input_: Annotated[str, typer.Argument(metavar="INPUT", help=targets.INPUT_HELP)],
    as_json: JsonOption = False,
) -> None:
    """Link an output to an input, whose source it replaces."""
    with connect(ctx) as client, waiting("linking"):
        source, target = targets.output(client, output), targets.input_(client, input_)
        with about(f"{source} → {target}"):
            status = client.link(source, target)
    name = status.name.lower()
    text = Text.assemble(f"{source} → {target}: ", (name, STATUS_STYLES[status]))
    show(ctx, as_json, {"output": str(source), "input": str(target), "status": name}, text)


def unlink(
    ctx: typer.Context,
    input_: Annotated[str, typer.Argument(metavar="INPUT", help=targets.INPUT_HELP)],
    as_json: JsonOption = False,
) -> None:
    """Remove the link of an input."""
    with connect(ctx) as client, waiting("unlinking"):
        target = targets.input_(client, input_)
        with about(target):
            client.unlink(target)
    show(ctx, as_json, {"input": str(target)}, f"{target}: has no link now")


def _links(count: int) -> str:
    return f"{count} {'link' if count == 1 else 'links'}"


def _act(ctx: typer.Context, as_json: bool, what: Action, done: str, argument: int = 0) -> None:
    """One action of the profile layer, and how many links it made or removed."""
    with connect(ctx) as client, waiting("working"):
        count = client.action(what, argument)
    show(ctx, as_json, {"links": count}, f"{_links(count)} {done}")


def clear(
    ctx: typer.Context, yes: YesOption = False, dry_run: DryRunOption = False, as_json: JsonOption = False
) -> None:
    """Remove all links."""
    with connect(ctx) as client:
        count = client.system_info().links
    if consented(ctx, as_json, f"remove {_links(count)}", yes or count == 0, dry_run):
        _act(ctx, as_json, Action.CLEAR, "removed")


def enforce(ctx: typer.Context, as_json: JsonOption = False) -> None:
    """Remove links that break sole access."""
    _act(ctx, as_json, Action.ENFORCE, "removed")


def replace(ctx: typer.Context, as_json: JsonOption = False) -> None:
    """Find stand-ins for missing channels of the active configuration."""
    _act(ctx, as_json, Action.REPLACE, "made")


def adopt(ctx: typer.Context, as_json: JsonOption = False) -> None:
    """Make the stand-ins part of the active configuration."""
    _act(ctx, as_json, Action.ADOPT, "adopted")


def autoconfig(
    ctx: typer.Context,
    what: Annotated[SwitchOrNow, typer.Argument(metavar="WHAT", help="on, off: by itself, or not; now: once.")],
    as_json: JsonOption = False,
) -> None:
    """Connect terminal channels that have no link: now, or by itself from now on."""
    if what is not SwitchOrNow.NOW:
        _switch(ctx, as_json, FlagName.AUTOCONFIGURE, what is SwitchOrNow.ON)
        return
    with connect(ctx) as client, waiting("working"):
        count = client.action(Action.AUTOCONFIGURE)
        why = "" if count else _why_none_was_made(client)
    data = {"links": count} | ({"why": why} if why else {})
    show(ctx, as_json, data, Text(f"{_links(count)} made" + (f": {why}" if why else "")))


def _why_none_was_made(client: Client) -> str:
    linked = {link.input for link in client.links()}
    terminal = [each.id for each in client.inputs() if each.type & TERMINAL]
    bare = [str(each) for each in terminal if each not in linked]
    if not terminal:
        return "no device has a terminal input"
    return f"no free output fits {', '.join(bare)}" if bare else "every terminal input has a link"


def flag(
    ctx: typer.Context,
    name: Annotated[FlagName, typer.Argument(metavar="NAME", help="Which; 'pdcp info' shows all.")],
    value: Annotated[Switch, typer.Argument(metavar="VALUE")],
    as_json: JsonOption = False,
) -> None:
    """Switch a setting of the arbitrator on or off. It is stored."""
    _switch(ctx, as_json, name, value is Switch.ON)


def _switch(ctx: typer.Context, as_json: bool, name: FlagName, on: bool) -> None:
    bit = Flags[name.name]
    with connect(ctx) as client:
        client.change_flags(on=bit) if on else client.change_flags(off=bit)
    show(ctx, as_json, {"flag": str(name), "on": on}, f"{name} {'on' if on else 'off'}")


def _name(number: int) -> str:
    return f"configuration {number}" if number else "active configuration"


def _missing(number: int) -> CommandError:
    return CommandError(f"there is no {_name(number)}; 'pdcp config export' shows what is stored")


@contextmanager
def _stored(number: int) -> Iterator[None]:
    """A number that is out of range inside is one under which nothing is stored."""
    try:
        yield
    except RequestError as error:
        if error.code == ErrorCode.OUT_OF_RANGE:
            raise _missing(number) from None
        raise


def _with_active(ctx: typer.Context, as_json: bool, number: int, act: Callable[[Client], str]) -> None:
    """An action on a configuration; tells which is active afterwards and how many are stored."""
    with connect(ctx) as client:
        with about(_name(number)):
            done = act(client)
        info = client.info()
    active = f"configuration {info.active} is active" if info.active else "none is active"
    data: Json = {"active_configuration": info.active, "stored_configurations": info.stored}
    show(ctx, as_json, data, f"{done}; {active}, {info.stored} stored")


def _is_stored(client: Client, number: int) -> bool:
    return any(stored.index == number for stored in parse(client.read_configurations()))


def save(
    ctx: typer.Context,
    number: NumberArgument = 0,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Store the links as a configuration. Over another than the active one it asks first."""

    def act(client: Client) -> str:
        with waiting("looking"):
            asks = not yes and number != 0 and number != client.info().active and _is_stored(client, number)
        require(f"overwrite {_name(number)}", not asks, "--yes")
        with waiting("working"):
            client.action(Action.SAVE, number)
        return "saved"

    _with_active(ctx, as_json, number, act)


def load(ctx: typer.Context, number: NumberArgument = 0, as_json: JsonOption = False) -> None:
    """Make the links of a stored configuration, and remove all others."""

    def act(client: Client) -> str:
        with _stored(number), waiting("working"):
            count = client.action(Action.LOAD, number)
        return f"loaded, {_links(count)} changed"

    _with_active(ctx, as_json, number, act)


def erase(
    ctx: typer.Context,
    number: NumberArgument = 0,
    yes: YesOption = False,
    dry_run: DryRunOption = False,
    as_json: JsonOption = False,
) -> None:
    """Forget a stored configuration. Its links stay as they are."""
    if dry_run or not yes:
        with connect(ctx) as client, waiting("looking"):
            chosen = number or client.info().active
            if not _is_stored(client, chosen):
                raise _missing(number)
        if not consented(ctx, as_json, f"erase configuration {chosen}", yes, dry_run):
            return

    def act(client: Client) -> str:
        with _stored(number), waiting("working"):
            client.action(Action.ERASE, number)
        return "erased"

    _with_active(ctx, as_json, number, act)
