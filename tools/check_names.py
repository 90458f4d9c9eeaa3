#!/usr/bin/env python3
"""Checks that a function that other files may call bears the name of its file: pdcp_link_step is found in pdcp_link.c.
Checks, too, that no name in the portable folders holds a word that docs/glossary.md has retired.

Two kinds of files give other names: those of a target carry out the contracts of hal/include, and ALSO lists a few with
their reasons.

Each violation is one line `file:line: message` on standard output. Exit status: 0 none, 1 some, 2 nothing to check.
"""

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from check_layers import COMMENT_OR_LITERAL, IDENTIFIER, PORTABLE, blank, find_functions, line_of

FOLDERS = ("pdcp", "profile", "firmware", "hal", "host_sim")

# File, without its suffix -> the prefix of its names, where that is another, and why.
ALSO = {
    "nvm_eeprom": "nvm",  # one of the two is linked
    "nvm_flash": "nvm",
    "can_gs_usb_absent": "can_gs_usb",  # stands for it where there is no libusb
}

# Word -> the one that docs/glossary.md has for it; the retired words that mean nothing else in a name.
RETIRED = {"stranger": "unknown", "strangers": "unknown", "wish": "request", "feed": "source", "slot": "place"}

# The link-time contract of a target (hal/include): any file of the target may carry a part of it out.
CONTRACT = "hal_"
# What the hardware or the C library calls by name.
ENTRY = re.compile(r"main|_\w+")
STATIC = re.compile(r"\b(static|PART_INLINE)\b")


def is_static(code: str, line: int) -> bool:
    """Is the function whose brace opens in this line its file's own?"""
    before = "\n".join(code.split("\n")[:line])
    head = re.split(r"[;}]", before[: before.rindex("{")])[-1]
    return STATIC.search(head) is not None


def prefixes(path: Path) -> tuple[str, ...]:
    """What the names of this file may begin with: its own name, in the plural and in the singular."""
    stem = ALSO.get(path.stem, path.stem)
    return (stem, stem.removesuffix("s"))


def check_file(path: Path, text: str) -> Iterator[tuple[int, str]]:
    code = COMMENT_OR_LITERAL.sub(blank, text)
    for name, line, _ in find_functions(code):
        if name.startswith((*prefixes(path), CONTRACT)) or ENTRY.fullmatch(name) or is_static(code, line):
            continue
        yield line, f"{name} does not begin with {prefixes(path)[0]}"


def check_words(text: str) -> Iterator[tuple[int, str]]:
    code = COMMENT_OR_LITERAL.sub(blank, text)
    for match in IDENTIFIER.finditer(code):
        for word in match.group().lower().split("_"):
            if word in RETIRED:
                message = f"{match.group()}: say {RETIRED[word]}, not {word} (docs/glossary.md)"
                yield line_of(code, match.start()), message


def main() -> int:
    parser = argparse.ArgumentParser(description="check that names begin with the name of their file")
    parser.add_argument("root", type=Path, nargs="?", default=Path(__file__).resolve().parent.parent)
    root: Path = parser.parse_args().root
    files = [path for folder in FOLDERS for path in sorted((root / folder).rglob("*.[ch]"))]
    if not files:
        print(f"check_names: no C files in the folders of {root}", file=sys.stderr)
        return 2
    count = 0
    for path in files:
        text = path.read_text(encoding="utf-8")
        found = [*check_file(path, text)] if path.suffix == ".c" else []
        if path.relative_to(root).parts[0] in PORTABLE:
            found += check_words(text)
        for line, message in found:
            print(f"{path.relative_to(root).as_posix()}:{line}: {message}")
            count += 1
    print(f"check_names: {len(files)} files, {count} violations", file=sys.stderr)
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
