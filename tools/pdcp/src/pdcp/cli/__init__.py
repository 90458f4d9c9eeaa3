"""The command pdcp."""

import sys
from types import ModuleType
from typing import Annotated

import typer

from . import bus, config, limb, links, ports, tables, targets, watch
from .common import HELP_NAMES, Settings, run

app = typer.Typer(
    name="pdcp",
    help="Looks into a PDCP limb and configures it, through its bus arbitrator.",
    epilog=targets.EPILOG,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)


@app.callback(context_settings={"help_option_names": HELP_NAMES})
def options(
    ctx: typer.Context,
    port: Annotated[
        str | None, typer.Option("--port", "-p", envvar="PDCP_PORT", metavar="PATH", help="Serial port or pty.")
    ] = None,
    baud: Annotated[
        int, typer.Option("--baud", min=1, metavar="RATE", help="57600 or 128000 bit/s; a pty takes any.")
    ] = 128000,
    timeout: Annotated[float, typer.Option("--timeout", min=0.01, metavar="S", help="Seconds for an answer.")] = 4.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=ports.print_version, help="Show the version and exit.")
    ] = False,
) -> None:
    ctx.obj = Settings(port, baud, timeout, as_json)


PANELS: dict[str, tuple[ModuleType, ...]] = {
    "Look": (tables, watch),
    "Devices": (limb,),
    "Links and configurations": (links, config),
    "Bus (no arbitrator needed)": (bus,),
    "Other": (ports,),
}


def build() -> None:
    """Registers all commands, each in the panel of its module, listed with the first sentence of its help."""
    for panel, modules in PANELS.items():
        before = len(app.registered_commands), len(app.registered_groups)
        for module in modules:
            module.register(app)
        for command in app.registered_commands[before[0] :]:
            command.rich_help_panel = panel
            text = " ".join((command.help or getattr(command.callback, "__doc__", None) or "").split())
            command.short_help = text.partition(". ")[0].rstrip(".")
        for group in app.registered_groups[before[1] :]:
            group.rich_help_panel = panel


build()


def main() -> None:
    sys.exit(run(app, sys.argv[1:]))
