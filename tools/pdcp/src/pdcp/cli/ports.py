"""Commands that need no arbitrator: ports, version."""

import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import typer
from rich.text import Text
from serial.tools import list_ports

from .. import __version__
from .common import Json, JsonOption, new_table, show

PROC = Path("/proc")
DAEMON = "pdcpd"


def register(app: typer.Typer) -> None:
    app.command()(ports)
    app.command()(version)


@dataclass(frozen=True)
class Daemon:
    """A running pdcpd. port is where its host API is; link: a symbolic link to it that the daemon made."""

    pid: int
    port: str | None
    link: str | None
    bus: str | None


def daemons(proc: Path = PROC) -> Iterator[Daemon]:
    """Running daemons that this user may look into; none where there is no /proc."""
    folders = (each for each in proc.iterdir() if each.name.isdecimal()) if proc.is_dir() else ()
    for folder in sorted(folders, key=lambda each: int(each.name)):
        try:
            words = (folder / "cmdline").read_bytes().split(b"\0")
            if Path(os.fsdecode(words[0])).name == DAEMON:
                yield _daemon(folder, [os.fsdecode(word) for word in words[1:]])
        except (FileNotFoundError, ProcessLookupError, PermissionError):
            continue  # it has ended, or it is another user's


def _daemon(folder: Path, arguments: list[str]) -> Daemon:
    host, bus = _option(arguments, "--host", "-H"), _option(arguments, "--can", "-c")
    kind, _, path = (host or "").partition(":")
    if kind == "serial":
        return Daemon(int(folder.name), path.partition("@")[0], None, bus)
    # A relative link lies where the daemon runs.
    link = str((folder / "cwd").readlink() / path) if path else None
    return Daemon(int(folder.name), _terminal(folder), link, bus)


def _option(arguments: list[str], long: str, short: str) -> str | None:
    """The value of an option; None: it is not on the command line, perhaps in a configuration file."""
    value = None
    for word, following in zip(arguments, [*arguments[1:], ""], strict=True):
        if word in (long, short):
            value = following
        elif word.startswith(f"{long}="):
            value = word.removeprefix(f"{long}=")
        elif word.startswith(short) and len(word) > len(short):
            value = word.removeprefix(short)
    return value


def _terminal(folder: Path) -> str | None:
    """The other end of the pseudo-terminal that a process holds: Linux tells its number with the file descriptor."""
    for descriptor in sorted((folder / "fd").iterdir()):
        if str(descriptor.readlink()) in ("/dev/ptmx", "/dev/pts/ptmx"):
            for line in (folder / "fdinfo" / descriptor.name).read_text(encoding="ascii").splitlines():
                key, _, value = line.partition(":")
                if key == "tty-index":
                    return f"/dev/pts/{value.strip()}"
    return None


def ports(ctx: typer.Context, as_json: JsonOption = False) -> None:
    """List serial ports and running daemons (pdcpd)."""
    table = new_table("Ports")
    table.add_column("port", style="bold", no_wrap=True)
    table.add_column("kind")
    table.add_column("what it is")
    rows: list[Json] = []
    for daemon in daemons():
        where = f"bus {daemon.bus}" if daemon.bus else "bus in its configuration file"
        rows.append({"port": daemon.port, "kind": "daemon", "link": daemon.link, "pid": daemon.pid, "text": where})
        link = f", also {daemon.link}" if daemon.link else ""
        table.add_row(Text(daemon.port or "?"), "daemon", Text(f"pdcpd, process {daemon.pid}, {where}{link}"))
    for port in sorted(list_ports.comports(), key=lambda each: str(each.device)):
        text = port.description if port.description not in (None, "n/a") else ""
        rows.append({"port": port.device, "kind": "serial", "link": None, "pid": None, "text": text})
        table.add_row(Text(port.device), "serial", Text(text))
    show(ctx, as_json, rows, table if rows else "no serial ports and no running pdcpd")


def print_version(wanted: bool) -> None:
    """The option --version."""
    if wanted:
        sys.stdout.write(f"pdcp {__version__}\n")
        raise typer.Exit


def version(ctx: typer.Context, as_json: JsonOption = False) -> None:
    """Show the version of this program; 'pdcp info' shows the arbitrator's."""
    data: Json = {
        "pdcp": __version__,
        "python": ".".join(str(part) for part in sys.version_info[:3]),
        "pyserial": metadata.version("pyserial"),
        "python-can": metadata.version("python-can"),
    }
    show(ctx, as_json, data, f"pdcp {__version__}")
