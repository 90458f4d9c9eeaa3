"""Stored configurations as files: `pdcp config`."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from ..tlv import TlvError, from_yaml, parse, to_yaml
from .common import JsonOption, UsageFault, about, connect, show, waiting
from .consent import DryRunOption, ForceOption, YesOption, consented, may_overwrite

HELP = "Stored configurations as YAML: out of an arbitrator, into it, or between files."

OutArgument = Annotated[str, typer.Argument(metavar="OUT", help="File; - is standard output.")]


def _read(path: str) -> bytes:
    try:
        return sys.stdin.buffer.read() if path == "-" else Path(path).read_bytes()
    except OSError as error:
        raise UsageFault(f"{path}: {error.strerror}") from error


def _write(path: str, data: bytes, force: bool) -> None:
    if path == "-":
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
        return
    may_overwrite(path, force)
    try:
        Path(path).write_bytes(data)
    except OSError as error:
        raise UsageFault(f"{path}: {error.strerror}") from error


def _encoded(path: str) -> tuple[bytes, int]:
    """The byte string of a YAML file, checked as an arbitrator checks it, and how many configurations it holds."""
    try:
        data = from_yaml(_read(path).decode("utf-8"))
        count = len(parse(data))
    except UnicodeDecodeError as error:
        raise UsageFault(f"{path}: byte {error.start}: no UTF-8") from error
    except TlvError as error:
        raise UsageFault(f"{path}: {error}") from error
    return data, count


def export(ctx: typer.Context, out: OutArgument = "-", force: ForceOption = False) -> None:
    """Write the stored configurations of the arbitrator as YAML."""
    with connect(ctx) as client, waiting("reading configurations") as step:
        data = client.read_configurations(step)
    _write(out, to_yaml(data).encode(), force)


def _count(configurations: int) -> str:
    return f"{configurations} {'configuration' if configurations == 1 else 'configurations'}"


def import_(
    ctx: typer.Context,
    file: Annotated[str, typer.Argument(metavar="FILE", help="YAML; - is standard input.")],
    yes: YesOption = False,
    dry_run: DryRunOption = False,
    as_json: JsonOption = False,
) -> None:
    """Store the configurations of a YAML file in the arbitrator, in place of those that it has."""
    data, count = _encoded(file)
    with connect(ctx) as client:
        old = client.info().stored
        what = f"store {_count(count)}" + (f" in place of {old}" if old else "")
        if not consented(ctx, as_json, what, yes or old == 0, dry_run):
            return
        with waiting("writing configurations") as step, about(file):
            client.write_configurations(data, step)
    text = f"{_count(count)} stored, {len(data)} bytes"
    show(ctx, as_json, {"stored_configurations": count, "bytes": len(data)}, text)


def decode(
    file: Annotated[str, typer.Argument(metavar="FILE", help="Byte string; - is standard input.")],
    out: OutArgument = "-",
    entries: Annotated[bool, typer.Option("--entries", help="Every entry as it stands, sound or not.")] = False,
    force: ForceOption = False,
) -> None:
    """Turn a stored byte string into YAML, without an arbitrator."""
    data = _read(file)
    if not entries:
        try:
            parse(data)
        except TlvError as error:
            raise UsageFault(f"{file}: {error}; --entries shows what is there") from error
    _write(out, to_yaml(data, entries).encode(), force)


def encode(
    file: Annotated[str, typer.Argument(metavar="FILE", help="YAML; - is standard input.")],
    out: OutArgument = "-",
    force: ForceOption = False,
) -> None:
    """Turn YAML into the byte string that an arbitrator stores."""
    _write(out, _encoded(file)[0], force)


def register(app: typer.Typer) -> None:
    group = typer.Typer(help=HELP, no_args_is_help=True)
    group.command("export")(export)
    group.command("import")(import_)
    group.command("decode")(decode)
    group.command("encode")(encode)
    app.add_typer(group, name="config")
