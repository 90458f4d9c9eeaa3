#!/usr/bin/env python3
"""Checks the rules of the house that a compiler does not: who may include whom, circles of files, names that the
portable folders may not use, and the length of functions and files.

Each violation is one line `file:line: message` on standard output. Exit status: 0 none, 1 some, 2 nothing to check.
"""

import argparse
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ALL_FOLDERS = ("pdcp", "profile", "firmware", "hal", "host_sim", "tests", "tools")

BUS = ("pdcp/common", "pdcp/arbitrator")
FIRMWARE = ("firmware", "firmware/host", "firmware/store")

# Room -> the rooms whose headers it may include besides its own. A file lies in the deepest room above it.
MAY_INCLUDE: dict[str, tuple[str, ...]] = {
    "pdcp": (),
    "pdcp/common": (),
    "pdcp/arbitrator": ("pdcp/common",),
    "pdcp/device": ("pdcp/common",),
    "profile": BUS,
    "firmware": ("firmware/host", "firmware/store", "profile", *BUS),
    "firmware/host": ("firmware", "firmware/store", "profile", *BUS),
    "firmware/store": ("profile", *BUS),
    "firmware/dspic33": (*FIRMWARE, "profile", *BUS, "pdcp/device", "hal"),
    "hal": (),
    "host_sim": (*FIRMWARE, "profile", *BUS, "pdcp/device", "hal"),
    "tests": ALL_FOLDERS,
    "tools": ALL_FOLDERS,
}
# Single headers that a room may include as well.
MAY_INCLUDE_HEADERS: dict[str, tuple[str, ...]] = {
    "hal": ("pdcp/common/can_frame.h",),
    "firmware/store": ("firmware/arb_error.h", "firmware/arb_limits.h", "firmware/arb_port.h"),
}

PORTABLE = ("pdcp", "profile", "firmware")
LENGTH_CHECKED = (*PORTABLE, "hal", "host_sim")
MAX_FUNCTION_LINES = 60
MAX_FILE_LINES = {"pdcp": 500, "profile": 500, "firmware": 500, "hal": 600, "host_sim": 600}

# Headers of a microcontroller's compiler; tests/fakes has stand-ins of the same name for tests on a PC.
VENDOR_HEADERS = frozenset(("xc.h",))

# What the C library offers to code that reads no clock, writes to no stream and knows no platform.
PORTABLE_LIBRARY = frozenset(
    f"{name}.h"
    for name in ("assert", "ctype", "errno", "float", "inttypes", "iso646", "limits", "math")
    + ("stdarg", "stdbool", "stddef", "stdint", "stdlib", "string")
)

# Only names that nobody needs for something else: the platform's other functions are out of reach without a header.
BANNED_NAMES = frozenset(
    # allocation
    ("malloc", "calloc", "realloc", "free", "alloca", "aligned_alloc", "strdup", "strndup")
    # streams
    + ("printf", "fprintf", "sprintf", "snprintf", "vprintf", "vfprintf", "vsprintf", "vsnprintf", "dprintf")
    + ("puts", "fputs", "putc", "putchar", "fputc", "perror", "fopen", "fread", "fwrite", "stdout", "stderr")
    # waiting
    + ("sleep", "usleep", "nanosleep", "clock_nanosleep")
    # clocks and chance
    + ("time", "clock", "clock_gettime", "gettimeofday", "localtime", "gmtime", "rand", "srand")
    # the platform
    + ("exit", "abort", "atexit", "getenv", "setjmp", "longjmp")
)

COMMENT_OR_LITERAL = re.compile(r'//(?:\\\n|[^\n])*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.DOTALL)
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(?P<open>["<])(?P<name>[^">\n]+)[">]', re.MULTILINE)
DIRECTIVE = re.compile(r"^[ \t]*#(?:\\\n|[^\n])*", re.MULTILINE)
IDENTIFIER = re.compile(r"\b[A-Za-z_]\w*\b")
FUNCTION_NAME = re.compile(r"\b([A-Za-z_]\w*)\s*\(")


def room_of(path: Path) -> str:
    """The deepest room that the file lies in."""
    for parent in path.parents:
        if parent.as_posix() in MAY_INCLUDE:
            return parent.as_posix()
    return path.parts[0]


@dataclass(frozen=True)
class Source:
    """One C file: its path from the root, its text, and its text without comments and literals."""

    path: Path
    text: str
    code: str

    @property
    def folder(self) -> str:
        return self.path.parts[0]

    @property
    def room(self) -> str:
        return room_of(self.path)

    @property
    def is_portable(self) -> bool:
        """The mains in firmware/dspic33 join a target's HAL to the application, or to the device role."""
        return self.folder in PORTABLE and self.room != "firmware/dspic33"


@dataclass(frozen=True)
class Violation:
    path: Path
    line: int
    message: str

    def __str__(self) -> str:
        return f"{self.path.as_posix()}:{self.line}: {self.message}"


def blank(match: re.Match[str]) -> str:
    """Replaces a comment or a literal by as many lines of nothing."""
    return " " + "\n" * match.group().count("\n")


def strip_comments(text: str) -> str:
    """Removes comments, leaves literals: for include lines, whose names look like strings."""
    return COMMENT_OR_LITERAL.sub(lambda match: blank(match) if match.group()[0] == "/" else match.group(), text)


def line_of(text: str, offset: int) -> int:
    return text.count("\n", 0, offset) + 1


def read_sources(root: Path) -> list[Source]:
    sources = []
    for folder in ALL_FOLDERS:
        for path in sorted((root / folder).rglob("*.[ch]")):
            text = path.read_text(encoding="utf-8")
            sources.append(Source(path.relative_to(root), text, COMMENT_OR_LITERAL.sub(blank, text)))
    return sources


def may_include(source: Source, header: Path) -> bool:
    room, target = source.room, room_of(header)
    if room == "hal" and target == "hal":
        # One target's files never see another target's.
        return header.parts[1] in ("include", source.path.parts[1])
    if header.as_posix() in MAY_INCLUDE_HEADERS.get(room, ()):
        return True
    return target == room or target in MAY_INCLUDE[room] or header.parts[0] in MAY_INCLUDE[room]


def find_headers(source: Source, name: str, headers: list[Path]) -> list[Path]:
    """The headers of the tree that an include of this name may mean: by its path's end, the nearest one first."""
    wanted = tuple(part for part in Path(name).parts if part not in (".", ".."))
    found = [header for header in headers if header.parts[-len(wanted) :] == wanted]
    beside = [header for header in found if header.parent == source.path.parent]
    return beside or found


def includes_of(source: Source, headers: list[Path]) -> Iterator[tuple[str, int, list[Path]]]:
    """Name and line of every include, and the headers of the tree that it may mean."""
    code = strip_comments(source.text)
    for match in INCLUDE.finditer(code):
        yield match["name"], line_of(code, match.start("name")), find_headers(source, match["name"], headers)


def check_includes(source: Source, headers: list[Path]) -> Iterator[Violation]:
    for name, line, found in includes_of(source, headers):
        if name in VENDOR_HEADERS and not source.is_portable:
            continue
        if found and not any(may_include(source, header) for header in found):
            yield Violation(source.path, line, f"{source.room}/ may not include {found[0].as_posix()}")
        elif not found and source.is_portable and name not in PORTABLE_LIBRARY:
            yield Violation(source.path, line, f"{source.folder}/ may not include {name}, it is portable")


def check_names(source: Source) -> Iterator[Violation]:
    if not source.is_portable:
        return
    code = INCLUDE.sub("", source.code)
    for match in IDENTIFIER.finditer(code):
        if match.group() in BANNED_NAMES:
            line = line_of(code, match.start())
            yield Violation(source.path, line, f"{match.group()} is banned in {source.folder}/, it is portable")


def find_functions(code: str) -> Iterator[tuple[str, int, int]]:
    """Name, first and last line of every function: from its opening to its closing brace, both included."""
    code = DIRECTIVE.sub(lambda match: "\n" * match.group().count("\n"), code)
    depth = start = previous_end = 0
    name = ""
    for match in re.finditer(r"[{};]", code):
        if match.group() == "{":
            if depth == 0:
                head = code[previous_end : match.start()]
                names = FUNCTION_NAME.findall(head)
                name = names[0] if names and head.rstrip().endswith(")") else ""
                start = match.start()
            depth += 1
        elif match.group() == "}":
            depth -= 1
            if depth == 0 and name:
                yield name, line_of(code, start), line_of(code, match.start())
        if depth == 0:
            previous_end = match.end()


def check_lengths(source: Source) -> Iterator[Violation]:
    if source.folder not in LENGTH_CHECKED:
        return
    for name, first, last in find_functions(source.code):
        length = last - first + 1
        if length > MAX_FUNCTION_LINES:
            message = f"function {name} has {length} lines, more than {MAX_FUNCTION_LINES}"
            yield Violation(source.path, first, message)


def check_size(source: Source) -> Iterator[Violation]:
    lines, limit = source.text.count("\n"), MAX_FILE_LINES.get(source.folder)
    if limit is not None and lines > limit:
        yield Violation(source.path, limit + 1, f"the file has {lines} lines, more than {limit}")


def check_circles(sources: list[Source], headers: list[Path]) -> Iterator[Violation]:
    """A source and its header are one unit; no unit includes, through whatever others, itself."""
    below: dict[Path, dict[Path, Violation]] = {}  # unit -> the units that it includes, and where
    for source in sources:
        if source.folder not in LENGTH_CHECKED:
            continue
        unit = source.path.with_suffix("")
        for _, line, found in includes_of(source, headers):
            for other in (header.with_suffix("") for header in found if may_include(source, header)):
                if other != unit:
                    place = Violation(source.path, line, f"{other.name}.h includes {unit.name}.h in turn: a circle")
                    below.setdefault(unit, {}).setdefault(other, place)
    for unit, others in sorted(below.items()):
        for other, place in others.items():
            if unit in reachable(below, other):
                yield place


def reachable(below: dict[Path, dict[Path, Violation]], start: Path) -> set[Path]:
    seen: set[Path] = set()
    waiting = [start]
    while waiting:
        for other in below.get(waiting.pop(), {}):
            if other not in seen:
                seen.add(other)
                waiting.append(other)
    return seen


def check_tree(root: Path) -> tuple[int, list[Violation]]:
    """The number of files checked and what was found in them."""
    sources = read_sources(root)
    headers = [source.path for source in sources if source.path.suffix == ".h"]
    violations: list[Violation] = []
    for source in sources:
        violations.extend(check_includes(source, headers))
        violations.extend(check_names(source))
        violations.extend(check_lengths(source))
        violations.extend(check_size(source))
    violations.extend(check_circles(sources, headers))
    return len(sources), violations


def main() -> int:
    parser = argparse.ArgumentParser(description="check includes, circles, banned names and lengths")
    parser.add_argument("root", type=Path, nargs="?", default=Path(__file__).resolve().parent.parent)
    root: Path = parser.parse_args().root
    count, violations = check_tree(root)
    if count == 0:
        print(f"check_layers: no C files in the folders of {root}", file=sys.stderr)
        return 2
    for violation in violations:
        print(violation)
    print(f"check_layers: {count} files, {len(violations)} violations", file=sys.stderr)
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main())
