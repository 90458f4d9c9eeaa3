"""docs/spec/protocol.toml, what reads it and what is generated from it. That the C code agrees with it is tested by
tests/unit/test_protocol_table.c; here, that it has no numbers which the table lacks."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from protocol_table import PLACE, Field, Table, TableError, built, load, sizes_of
from protocol_table import parse as parse_table

from pdcp.events import UnknownEvent, parse
from pdcp.messages import MESSAGES, EventMessage, FormatError

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tools/gen_protocol.py"
TEXT = (ROOT / PLACE).read_text(encoding="utf-8")

# Headers whose numbers all stand in the table, and what in them is no number of the protocol.
HEADERS = {
    "pdcp_spec.h": (),
    "pdcp_stats.h": ("PDCP_STAT_COUNT",),
    "arb_error.h": (),
    # Sizes and places of fields: the table has them as the fields of messages.
    "arb_hostcodec.h": (
        *("ARB_CHANNEL_BYTES", "ARB_LINK_BYTES", "ARB_INFO_BYTES", "ARB_AT_INDEX", "ARB_AT_PARAM", "ARB_AT_VALUE"),
        *("ARB_AT_DLC", "ARB_AT_DATA", "ARB_AT_OFFSET", "ARB_AT_LENGTH", "ARB_AT_PIECE"),
    ),
    "profile_tree.h": (),
}


def table() -> Table:
    return load(ROOT)


# --- the table and the headers --------------------------------------------------------------------


def folders_of_c() -> list[Path]:
    return sorted({path.parent for top in ("pdcp", "profile", "firmware") for path in (ROOT / top).rglob("*.h")})


def own_lines(header: Path) -> Iterator[str]:
    """What the preprocessor makes of a header, without what it includes: no comments, and the macros it defines."""
    includes = [f"-I{folder}" for folder in folders_of_c()]
    found = subprocess.run(
        ["cc", "-std=c99", "-E", "-dD", *includes, header], capture_output=True, text=True, check=True
    )
    inside = False
    for line in found.stdout.splitlines():
        if match := re.match(r'# \d+ "(.*?)"', line):
            inside = match[1] == str(header)
        elif inside:
            yield line


def constants_of(name: str) -> set[str]:
    """The enumerators of a header, and its macros that have a value and take no arguments."""
    (header,) = [path for folder in folders_of_c() for path in folder.glob(name)]
    lines = list(own_lines(header))
    macros = {match[1] for line in lines if (match := re.match(r"#define (\w+) \S", line))}
    code = " ".join(line for line in lines if not line.startswith("#"))
    bodies = re.findall(r"\benum\b\s*\w*\s*\{([^}]*)\}", code)
    return macros | {part.split("=")[0].strip() for body in bodies for part in body.split(",") if part.strip()}


@pytest.mark.parametrize("name", HEADERS)
def test_no_constant_of_a_header_is_missing(name: str) -> None:
    found = constants_of(name)
    assert len(found) > 10
    assert found - {c for c, _ in table().c_numbers()} == set(HEADERS[name])


def test_constants_of_a_header_are_seen() -> None:
    found = constants_of("pdcp_spec.h")
    assert {"PDCP_BIND_DEVICE", "PDCP_AGE_MAX_MS", "PDCP_TYPE_SOLE", "PDCP_USE_BULK"} <= found
    assert not {"PDCP_SPEC_H", "uint16_t", "UINT16_MAX"} & found


# --- what the table says --------------------------------------------------------------------------


def test_only_what_is_built_is_a_message_of_the_package() -> None:
    numbers = [
        number
        for message in built(table().messages)
        for number in range(message.number, message.number + (3 if message.sender == "host" else 1))
    ]
    assert sorted(MESSAGES) == numbers


def test_later_entries_have_no_number_in_c() -> None:
    names = {name for name, _ in table().c_numbers()}
    assert "ARB_MSG_EVENT" in names and "PDCP_IN_TERMINAL_PROFILE" in names
    assert not {"ARB_MSG_WATCH", "ARB_ERR_NOT_ALLOWED", "PDCP_OUT_PERIOD", "ARB_EVENT_VALUE"} & names


def sample(layout: tuple[Field, ...]) -> bytes:
    """Data of an event; every number is 1, which is a status and a state, or the size of what stands behind."""
    least, most = sizes_of(layout)
    return b"\1" * (least if most is not None else least + 1)


def test_events_are_read_as_the_table_says() -> None:
    for event in table().events:
        data = sample(event.fields)
        read = parse(EventMessage(event.number, 7, data))
        assert isinstance(read, UnknownEvent) == event.later
        for wrong in () if event.later else (data[:-1], data + b"\1"):
            with pytest.raises(FormatError):
                parse(EventMessage(event.number, 7, wrong))


# --- a table that is not sound --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('"devices: u8", "inputs: u8"', '"devices: u9", "inputs: u8"', 'message 2201h: "devices: u9" is no field'),
        ('"devices: u8", "inputs: u8"', '"devices: u8", "devices: u8"', "message 2201h: devices is there twice"),
        ('"status: u8 link_status"', '"status: u8 links"', 'message 220Dh: "status: u8 links" is no field'),
        ('success = ["value: bytes"]', 'success = ["value: bytes", "n: u8"]', "behind one that takes all"),
        ("reads = true", "read = true", "message 2201h: unknown key read"),
        ("number = 0x2204", "number = 0x2203", "messages: 8707 is there twice"),
        ("number = 0x2204", "number = 0x2604", "it has no group"),
        ('name = "BUSY"', 'name = "SIZE", client = "X"', "ARB_ERR_SIZE is there twice"),
        ('of = ["device"]\nnumber = 2\n', 'of = ["device"]\nnumber = 1\n', "parameters of device: 1 is there twice"),
        ('access = "read"', 'access = "none"', "none is none of read, arbitrator, write"),
        ("dlc = [7]", "dlc = [6]", "function 01h: the fields do not fit the sizes"),
        ("dlc = [7]", "dlc = [9]", "function 01h: a frame has 1 to 8 bytes"),
        ('from = ["device"]', 'from = ["host"]', "function 01h: host is none of device, arbitrator"),
        ("[profiles.1220]", "[profiles.1522]", "profile 1522: it has no parent"),
        ("version = 1", "version 1", "line"),
        ("version = 1", "", "'version' is missing"),
    ],
)
def test_an_unsound_table(old: str, new: str, what: str) -> None:
    assert old in TEXT
    with pytest.raises(TableError, match=re.escape(what)):
        parse_table(TEXT.replace(old, new, 1))


# --- the generator --------------------------------------------------------------------------------


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-B", SCRIPT, *arguments], capture_output=True, text=True, check=False)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """The table and an empty package."""
    (tmp_path / PLACE).parent.mkdir(parents=True)
    shutil.copy(ROOT / PLACE, tmp_path / PLACE)
    (tmp_path / "tools/pdcp/src/pdcp").mkdir(parents=True)
    return tmp_path


def test_the_package_is_up_to_date() -> None:
    found = run("--check")
    assert (found.returncode, found.stdout) == (0, "")


def test_check_says_what_is_not_up_to_date(tree: Path) -> None:
    assert run("--root", tree).returncode == 0
    assert run("--root", tree, "--check").returncode == 0
    (tree / PLACE).write_text(TEXT.replace("the device refused", "the device said no"), encoding="utf-8")
    found = run("--root", tree, "--check")
    assert (found.returncode, found.stdout) == (
        1,
        "tools/pdcp/src/pdcp/protocol.py: not up to date, run tools/gen_protocol.py\n",
    )
    assert "said no" not in (tree / "tools/pdcp/src/pdcp/protocol.py").read_text(encoding="utf-8")
    assert run("--root", tree).returncode == 0
    assert "said no" in (tree / "tools/pdcp/src/pdcp/protocol.py").read_text(encoding="utf-8")


def test_an_unsound_table_generates_nothing(tree: Path) -> None:
    (tree / PLACE).write_text(TEXT.replace("reads = true", "read = true"), encoding="utf-8")
    found = run("--root", tree)
    assert (found.returncode, found.stderr) == (2, "docs/spec/protocol.toml: message 2201h: unknown key read\n")
    assert not list((tree / "tools/pdcp/src/pdcp").iterdir())


def test_the_header_is_c(tmp_path: Path) -> None:
    header = tmp_path / "protocol_table.h"
    assert run("--header", header).returncode == 0
    source = tmp_path / "all.c"
    source.write_text('#include "protocol_table.h"\n#define X(a, b) b,\nlong all[] = {PROTOCOL_NUMBERS(X)};\n')
    subprocess.run(["cc", "-std=c99", "-pedantic-errors", "-Wall", "-Werror", "-fsyntax-only", source], check=True)
