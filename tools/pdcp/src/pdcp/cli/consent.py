"""Consent: a command that loses something asks first on a terminal, and wants an option elsewhere."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from .common import CommandError, UsageFault, show

YesOption = Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")]
AllOption = Annotated[bool, typer.Option("--all", help="All devices, without a question.")]
ForceOption = Annotated[bool, typer.Option("--force", "-f", help="Overwrite a file without a question.")]
DryRunOption = Annotated[bool, typer.Option("--dry-run", "-n", help="Say what would be done, and do nothing.")]


def require(what: str, given: bool, option: str) -> None:
    """Returns if the user agrees to what is about to be done, such as "remove 4 links".

    Raises CommandError if the user says no, and UsageFault where there is nobody to ask: the option is named then."""
    if given:
        return
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise UsageFault(f"this would {what}: give {option} if that is what you want")
    if not typer.confirm(f"This will {what}. Go on?", err=True):
        raise CommandError("nothing was changed")


def may_overwrite(path: str, force: bool) -> None:
    """As require(), if there is a regular file at the path."""
    require(f"overwrite {path}", force or not Path(path).is_file(), "--force")


def consented(ctx: typer.Context, as_json: bool, what: str, yes: bool, dry_run: bool, option: str = "--yes") -> bool:
    """False for a dry run, which says what would be done. Else as require()."""
    if dry_run:
        show(ctx, as_json, {"would": what}, f"would {what}")
        return False
    require(what, yes, option)
    return True
