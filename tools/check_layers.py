#!/usr/bin/env python3
"""Checks the rules of the house that a compiler does not: who may include whom, names that the portable folders may
not use, and the length of functions.

Each violation is one line `file:line: message` on standard output. Exit status: 0 none, 1 some, 2 nothing to check.
"""

import argparse
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ALL_FOLDERS = ("pdcp", "profile", "firmware", "hal", "host_sim", "tests", "tools")

# Folder -> the folders whose headers it may include besides its own.
MAY_INCLUDE: dict[str, tuple[str, ...]] = {
    "pdcp": (),
    "profile": ("pdcp",),
    "firmware": ("profile", "pdcp"),
    "hal": (),
    "host_sim": ("pdcp", "profile", "firmware", "hal"),
    "tests": ALL_FOLDERS,
    "tools": ALL_FOLDERS,
}
# The one header of pdcp/ that hal/ may include.
FRAME_HEADER = "can_frame.h"

PORTABLE = ("pdcp", "profile", "firmware")
LENGTH_CHECKED = (*PORTABLE, "hal", "host_sim")
MAX_FUNCTION_LINES = 60

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
    def is_portable(self) -> bool:
        return self.folder in PORTABLE and not self.is_firmware_main

    @property
    def is_firmware_main(self) -> bool:
        """A main of firmware/ joins a target's HAL to the application, or to the device role."""
        return self.folder == "firmware" and self.path.name.startswith(("main_", "node_"))


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
    folder, target = source.folder, header.parts[0]
    if folder == "hal" and target == "hal":
        # One target's files never see another target's.
        return header.parts[1] in ("include", source.path.parts[1])
    if folder == "hal" and target == "pdcp":
        return header.name == FRAME_HEADER
    if source.is_firmware_main and target == "hal":
        return True
    return target == folder or target in MAY_INCLUDE[folder]


def find_headers(source: Source, name: str, headers: list[Path]) -> list[Path]:
    """The headers of the tree that an include of this name may mean: by its path's end, the nearest one first."""
    wanted = tuple(part for part in Path(name).parts if part not in (".", ".."))
    found = [header for header in headers if header.parts[-len(wanted) :] == wanted]
    beside = [header for header in found if header.parent == source.path.parent]
    return beside or found


def check_includes(source: Source, headers: list[Path]) -> Iterator[Violation]:
    code = strip_comments(source.text)
    for match in INCLUDE.finditer(code):
        name, line = match["name"], line_of(code, match.start("name"))
        if name in VENDOR_HEADERS and not source.is_portable:
            continue
        found = find_headers(source, name, headers)
        if found and not any(may_include(source, header) for header in found):
            yield Violation(source.path, line, f"{source.folder}/ may not include {found[0].as_posix()}")
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


def check_tree(root: Path) -> tuple[int, list[Violation]]:
    """The number of files checked and what was found in them."""
    sources = read_sources(root)
    headers = [source.path for source in sources if source.path.suffix == ".h"]
    violations: list[Violation] = []
    for source in sources:
        violations.extend(check_includes(source, headers))
        violations.extend(check_names(source))
        violations.extend(check_lengths(source))
    return len(sources), violations


def main() -> int:
    parser = argparse.ArgumentParser(description="check includes, banned names and function lengths")
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
