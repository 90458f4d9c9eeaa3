"""What all commands share: the connection, tables or JSON, and one place that turns errors into exit codes."""

import json
import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, Any

import typer
import typer.main
from rich import box
from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from typer.core import TyperGroup, TyperOption
from typer.exceptions import Abort, Exit, TyperException

from ..client import Client
from ..errors import BadAnswerError, ConnectionFailedError, NoAnswerError, PdcpError, RequestError
from ..messages import FormatError

PIPE_WIDTH = 500  # columns: a row stays one line where no terminal limits it
PROGRESS_AFTER_S = 1.0
LINE_MAX = 400  # characters of a complaint

Json = dict[str, Any]


class Status(IntEnum):
    """Exit codes."""

    OK = 0
    REFUSED = 1  # the arbitrator said no, or something failed on the way
    USAGE = 2
    NO_CONNECTION = 3
    TIMEOUT = 4
    INTERRUPTED = 130


class CommandError(Exception):
    """A command cannot go on; the text is the one line that the user gets."""

    def __init__(self, message: str, status: Status = Status.REFUSED) -> None:
        super().__init__(message)
        self.status = status


class UsageFault(CommandError):
    """Wrong arguments."""

    def __init__(self, message: str) -> None:
        super().__init__(message, Status.USAGE)


@dataclass(frozen=True)
class Settings:
    """The options before the command."""

    port: str | None
    baud: int
    timeout_s: float
    json: bool


# What the argument parser says of a value, and how this program says it.
_WORDING = (
    ("Value error, ", ""),
    ("Input should be", "must be"),
    (", unable to parse string as an integer", ""),
    (", unable to parse string as a number", ""),
)

HELP_NAMES = ["-h", "--help"]

# Options of the program that take a value; no command has one of the same name.
PROGRAM_OPTIONS = ("--port", "-p", "--baud", "--timeout")

JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]


def settings(ctx: typer.Context) -> Settings:
    found = ctx.find_object(Settings)
    assert found is not None, "the callback of the application has set it"
    return found


def connect(ctx: typer.Context) -> Client:
    """A client at the port that the user named; use it in a with statement."""
    options = settings(ctx)
    if options.port is None:
        raise UsageFault("no port: give --port PATH or set PDCP_PORT; 'pdcp ports' shows what there is")
    return Client(options.port, options.baud, timeout_s=options.timeout_s)


@contextmanager
def about(what: object) -> Iterator[None]:
    """Puts in front of a refusal what was asked for."""
    try:
        yield
    except RequestError as error:
        raise CommandError(f"{what}: {error}") from error


def wants_json(ctx: typer.Context, as_json: bool) -> bool:
    """--json may stand before the command or behind it."""
    return as_json or settings(ctx).json


def new_console(stderr: bool = False) -> Console:
    """A console for tables. Without a terminal lines are as long as they need to be, unless COLUMNS says otherwise."""
    console = Console(stderr=stderr, highlight=False, emoji=False)
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console.width = PIPE_WIDTH
    return console


def new_table(title: str = "") -> Table:
    """An empty table in the style of all others. Escape text of devices with rich.text.Text or rich.markup.escape."""
    return Table(
        title=title or None,
        title_style="bold",
        title_justify="left",
        header_style="dim",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )


def json_text(data: object, indent: int | None = None) -> str:
    """JSON that is safe for a terminal: letters stand as they are, what is not printable is escaped."""
    text = json.dumps(data, ensure_ascii=False, indent=indent)
    return "".join(each if each.isprintable() or each == "\n" else json.dumps(each)[1:-1] for each in text)


def print_json(data: object) -> None:
    """One JSON document, indented on a terminal, one line otherwise."""
    sys.stdout.write(json_text(data, indent=2 if sys.stdout.isatty() else None) + "\n")
    sys.stdout.flush()


def show(ctx: typer.Context, as_json: bool, data: object, *tables: RenderableType) -> None:
    """Prints the data as JSON where that is wanted, else the tables."""
    if wants_json(ctx, as_json):
        print_json(data)
        return
    console = new_console()
    for table in tables:
        console.print(table)


@contextmanager
def waiting(what: str, total: int | None = None) -> Iterator[Callable[..., None]]:
    """A progress bar on a terminal's standard error, once it has taken longer than a second. What it yields is to be
    called for each step, or as step(done, total)."""
    console = new_console(stderr=True)
    if not console.is_terminal:
        yield lambda *_: None
        return
    columns = [TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()]
    progress = Progress(*columns, console=console, transient=True)
    task = progress.add_task(what, total=total)

    def step(done: int | None = None, of: int | None = None) -> None:
        if done is None:
            progress.advance(task)
        else:
            progress.update(task, completed=done, total=of)

    timer = threading.Timer(PROGRESS_AFTER_S, progress.start)
    timer.daemon = True
    timer.start()
    try:
        yield step
    finally:
        timer.cancel()
        timer.join()  # it may just be starting
        progress.stop()


def reason(error: Exception) -> str:
    """What went wrong in words; of an error of the system without its number."""
    return (isinstance(error, OSError) and error.strerror) or str(error)


def _wording(error: TyperException) -> str:
    text = error.format_message()
    for theirs, ours in _WORDING:
        text = text.replace(theirs, ours)
    return text.rstrip(".")


def one_line(text: str) -> str:
    """A text that may hold anything as one line that is safe for a terminal: control characters and those that turn
    the direction of writing are escaped, and a long line ends in dots."""
    line = " ".join(text.split())
    line = line if len(line) <= LINE_MAX else f"{line[:LINE_MAX]}..."
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in line)


def _complain(text: str, status: Status) -> int:
    sys.stderr.write(f"pdcp: {one_line(text)}\n")
    return status


def _status_of(error: PdcpError) -> Status:
    if isinstance(error, NoAnswerError):
        return Status.TIMEOUT
    if isinstance(error, ConnectionFailedError | BadAnswerError):
        return Status.NO_CONNECTION
    return Status.REFUSED


def _tidy_help(group: TyperGroup) -> None:
    """Typer's help tells the type of every option, also of one that takes no value and of --help; a text to stand in
    its place, even an empty one, goes before it."""
    for command in (group, *group.commands.values()):
        for option in command.get_params(typer.Context(command, help_option_names=HELP_NAMES)):
            if isinstance(option, TyperOption) and option.is_flag:
                option.metavar = ""
        if isinstance(command, TyperGroup) and command is not group:
            _tidy_help(command)


def _program_options_first(arguments: Sequence[str]) -> list[str]:
    """Options of the program may stand anywhere before --; the parser wants them before the command."""
    first: list[str] = []
    rest: list[str] = []
    words = iter(arguments)
    for word in words:
        if word == "--":
            rest += [word, *words]
        elif word in PROGRAM_OPTIONS:
            value = next(words, None)
            if value is None:
                raise UsageFault(f"{word} needs a value")
            first += [word, value]
        elif word.partition("=")[0] in PROGRAM_OPTIONS:
            first.append(word)
        else:
            rest.append(word)
    return first + rest


def run(app: typer.Typer, arguments: Sequence[str]) -> int:
    """Runs the application and returns its exit code; whatever went wrong is one line on standard error."""
    command = typer.main.get_command(app)
    if isinstance(command, TyperGroup):
        _tidy_help(command)
    try:
        status = command.main(_program_options_first(arguments), prog_name="pdcp", standalone_mode=False)
        sys.stdout.flush()
        return status if isinstance(status, int) else Status.OK
    except Exit as end:
        return end.exit_code
    except (Abort, KeyboardInterrupt):
        return Status.INTERRUPTED
    except CommandError as error:
        return _complain(str(error), error.status)
    except PdcpError as error:
        return _complain(str(error), _status_of(error))
    except FormatError as error:  # a value that no message can carry
        return _complain(str(error), Status.USAGE)
    except TyperException as error:
        # Without text: a group was called without a command, and its help has been shown.
        text = _wording(error)
        return _complain(f"{text} ('pdcp --help' tells more)", Status.USAGE) if text else Status.USAGE
    except BrokenPipeError:
        # The reader has gone; the interpreter flushes standard output once more at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Status.REFUSED
    except OSError as error:
        return _complain(str(error), Status.REFUSED)
