"""Commands that ask and tell devices: get, set, suspend, release, reset, passthrough."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import typer
from rich.text import Text

from ..client import Client
from ..model import BROADCAST, ChannelId, Identity, parse_number
from ..parameters import PARAMETERS, TRANSFER_KINDS, TRANSFER_TYPE, Kind, Parameter, find
from . import targets
from .common import Json, JsonOption, UsageFault, about, connect, show, waiting
from .consent import AllOption, DryRunOption, consented
from .tables import parameter_grid, parameter_json, parameters_json, read_parameters

CAN_DATA_MAX = 8
SUSPEND_MAX_MS = 0xFFFF
PARAMETER_HELP = "Number or name, such as 7 or descriptor; 'get TARGET' shows all."
SIZES = {"u8": 1, "u16": 2, "u32": 4}

TargetArgument = Annotated[str, typer.Argument(metavar="TARGET", help=targets.TARGET_HELP)]
DevicesArgument = Annotated[
    list[str] | None, typer.Argument(metavar="DEVICE", help=f"{targets.DEVICE_HELP} Without: all, after a question.")
]


def register(app: typer.Typer) -> None:
    app.command(epilog=targets.EPILOG)(get)
    # A negative number is a value, not an option.
    app.command(name="set", epilog=targets.EPILOG, context_settings={"ignore_unknown_options": True})(set_)
    app.command(epilog=targets.EPILOG)(suspend)
    app.command(epilog=targets.EPILOG)(release)
    app.command(epilog=targets.EPILOG)(reset)
    app.command(epilog=targets.EPILOG)(passthrough)


# --- parameters ---


def _kind(client: Client, target: ChannelId) -> Kind:
    """What a target is; a channel is asked itself."""
    if target.index == 0:
        return Kind.DEVICE
    with about(target):
        value = client.get_parameter(target, TRANSFER_TYPE)
    return TRANSFER_KINDS.get(int.from_bytes(value[:1]), Kind.INPUT)


def _find(kind: Kind, text: str) -> Parameter | int:
    try:
        return find(kind, text)
    except ValueError as error:
        raise UsageFault(str(error)) from None


def _number(parameter: Parameter | int) -> int:
    return parameter if isinstance(parameter, int) else parameter.number


def _name(parameter: Parameter | int) -> str:
    return f"parameter {parameter}" if isinstance(parameter, int) else parameter.name


def _value_json(parameter: Parameter | int, value: bytes) -> Json:
    if isinstance(parameter, int):
        return {"parameter": parameter, "name": None, "value": None, "text": value.hex(" "), "raw": value.hex()}
    return parameter_json(parameter, value)


def get(
    ctx: typer.Context,
    target: TargetArgument,
    parameter: Annotated[
        str | None, typer.Argument(metavar="PARAMETER", help=f"{PARAMETER_HELP} Without: all.")
    ] = None,
    raw: Annotated[bool, typer.Option("--raw", help="The bytes in hexadecimal.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Read a parameter of a device or channel, or all."""
    with connect(ctx) as client:
        found = targets.any_target(client, target)
        kind = _kind(client, found)
        head: Json = {"id": str(found), "kind": str(kind)}
        if parameter is None:
            with waiting("reading parameters", len(PARAMETERS[kind])) as step, about(found):
                read = read_parameters(client, found, kind, step)
            show(ctx, as_json, head | {"parameters": parameters_json(read)}, parameter_grid(read, 0))
            return
        chosen = _find(kind, parameter)
        with waiting("reading"), about(f"{found}, {_name(chosen)}"):
            value = client.get_parameter(found, _number(chosen))
    data = head | _value_json(chosen, value)
    show(ctx, as_json, data, Text(value.hex(" ") if raw else str(data["text"])))


def _bytes(word: str) -> bytes | None:
    """A value with a prefix that says how it is written; None: it has none."""
    prefix, colon, rest = word.partition(":")
    if not colon:
        return None
    try:
        if prefix == "hex":
            return bytes.fromhex(rest)
        if prefix == "text":
            return rest.encode()
        if prefix in SIZES:
            return parse_number(rest).to_bytes(SIZES[prefix], "little")
    except (ValueError, OverflowError) as error:
        reason = f"does not fit {prefix}" if isinstance(error, OverflowError) else f"is wrong: {error}"
        raise UsageFault(f"'{word}' {reason}") from None
    return None


def parse_value(parameter: Parameter | int, words: list[str]) -> bytes:
    """What a user wrote, as bytes. Raises UsageFault."""
    value = _bytes(words[0]) if len(words) == 1 else None
    if value is None:
        if isinstance(parameter, int):
            raise UsageFault(
                f"how parameter {parameter} is laid out is not known: write its value as hex:..., text:..., u8:N, "
                "u16:N or u32:N"
            )
        try:
            value = parameter.parse(words)
        except ValueError as error:
            told = str(error)
            raise UsageFault(told if parameter.name in told else f"{parameter.name}: {told}") from None
    if not value:
        raise UsageFault("a value must have one byte at least")
    return value


def set_(
    ctx: typer.Context,
    target: TargetArgument,
    parameter: Annotated[str, typer.Argument(metavar="PARAMETER", help=PARAMETER_HELP)],
    value: Annotated[
        list[str],
        typer.Argument(
            metavar="VALUE",
            help="As 'get' prints it, or a number for each field, on or off, text, channels (2,3). For any parameter: "
            "hex:01F4, text:..., u8:N, u16:N, u32:N.",
        ),
    ],
    as_json: JsonOption = False,
) -> None:
    """Write a parameter of a device or channel."""
    with connect(ctx) as client:
        found = targets.any_target(client, target)
        # A channel is asked what it is only where that matters.
        by_number = parameter.isdecimal() and len(value) == 1 and _bytes(value[0]) is not None
        chosen = _find(Kind.DEVICE if by_number else _kind(client, found), parameter)
        data = parse_value(chosen, value)
        with waiting("writing"), about(f"{found}, {_name(chosen)}"):
            client.set_parameter(found, _number(chosen), data)
    shown = data.hex(" ") if isinstance(chosen, int) else chosen.show(data)
    text = Text(f"{found}: {_name(chosen)} set to {shown}")
    show(ctx, as_json, {"id": str(found), "parameter": _number(chosen), "raw": data.hex()}, text)


# --- commands to devices ---


@dataclass(frozen=True)
class _Order:
    """What is done to devices, in words: suspend, suspended, until released."""

    verb: str
    done: str
    how_long: str = ""
    harmless: bool = False  # all may be told so without a question


def _count(devices: int) -> str:
    return "the only device" if devices == 1 else f"all {devices} devices"


def _each(
    ctx: typer.Context,
    as_json: bool,
    names: list[str] | None,
    order: _Order,
    act: Callable[[Client, Identity | None], None],
    everyone: bool = False,
    dry_run: bool = False,
) -> None:
    """Does something to each of the devices named, or at once to all, and says to whom."""
    if names and everyone:
        raise UsageFault("give devices or --all, not both")
    with connect(ctx) as client:
        chosen = [targets.device(client, name) for name in names or []]
        told = chosen or [device.identity for device in client.devices()]
        whom = ", ".join(map(str, chosen)) or _count(len(told))
        agreed = everyone or bool(names) or order.harmless or not told
        what = f"{order.verb} {whom} {order.how_long}".rstrip()
        if not consented(ctx, as_json, what, agreed, dry_run, option="--all"):
            return
        with waiting("working"):
            orders: list[Identity | None] = [*chosen] or [None]
            for identity in orders:
                with about(identity or "all devices"):
                    act(client, identity)
    text = ", ".join(map(str, told)) or "there is no device"
    done = f"{order.done} {order.how_long}".rstrip()
    show(ctx, as_json, {"devices": [str(each) for each in told]}, Text(f"{text}: {done}"))


def suspend(
    ctx: typer.Context,
    device: DevicesArgument = None,
    ms: Annotated[
        int,
        typer.Option("--ms", min=0, max=SUSPEND_MAX_MS, metavar="MS", help="For so long; 0: until they are released."),
    ] = 0,
    everyone: AllOption = False,
    dry_run: DryRunOption = False,
    as_json: JsonOption = False,
) -> None:
    """Make devices stop sending channel data. Inputs that they feed keep their last value."""
    order = _Order("suspend", "suspended", f"for {ms} ms" if ms else "until released ('pdcp release')")
    _each(ctx, as_json, device, order, lambda client, identity: client.suspend(identity, ms), everyone, dry_run)


def release(
    ctx: typer.Context,
    device: Annotated[
        list[str] | None, typer.Argument(metavar="DEVICE", help=f"{targets.DEVICE_HELP} Without: all.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Let suspended devices send again."""
    order = _Order("release", "released", harmless=True)
    _each(ctx, as_json, device, order, lambda client, identity: client.release(identity))


def reset(
    ctx: typer.Context,
    device: DevicesArgument = None,
    everyone: AllOption = False,
    dry_run: DryRunOption = False,
    as_json: JsonOption = False,
) -> None:
    """Reset devices. They bind again and get their links back."""
    order = _Order("reset", "reset")
    _each(ctx, as_json, device, order, lambda client, identity: client.reset(identity), everyone, dry_run)


def passthrough(
    ctx: typer.Context,
    device: Annotated[str, typer.Argument(metavar="DEVICE", help=f"{targets.DEVICE_HELP} 'all' broadcasts.")],
    data: Annotated[list[str], typer.Argument(metavar="BYTES", help="1 to 8 bytes in hexadecimal: 03 07 00.")],
    as_json: JsonOption = False,
) -> None:
    """Send a frame to a device and show the data of its answer."""
    try:
        frame = bytes.fromhex("".join(word.rjust(2, "0") if len(word) == 1 else word for word in data))
    except ValueError:
        raise UsageFault(f"'{' '.join(data)}' are no bytes in hexadecimal") from None
    if not 1 <= len(frame) <= CAN_DATA_MAX:
        raise UsageFault(f"a frame has 1 to {CAN_DATA_MAX} bytes, not {len(frame)}")
    with connect(ctx) as client:
        identity = BROADCAST if device == "all" else targets.device(client, device)
        with about("broadcast" if identity == BROADCAST else identity):
            answer = client.passthrough(identity, frame)
    text = answer.hex(" ").upper()
    show(ctx, as_json, {"id": str(identity), "sent": frame.hex(), "answer": answer.hex()}, Text(text))
