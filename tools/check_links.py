#!/usr/bin/env python3
"""Checks the links of Markdown files: a link within the tree must lead to a file or folder that exists, and its anchor
to a heading. Links to other places (with a scheme) are not followed.

Each finding is one line on standard output. Exit status: 0 none, 1 some, 2 a file cannot be read.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit

from anchors import anchor_of
from markdown_it import MarkdownIt
from markdown_it.token import Token


def parse(path: Path) -> list[Token]:
    return MarkdownIt("commonmark").enable("table").parse(path.read_text(encoding="utf-8"))


def anchors_in(path: Path) -> set[str]:
    """The anchors of a file's headings; of headings with the same name the second has -1 behind it, and so on."""
    tokens = parse(path)
    anchors: set[str] = set()
    for token, inline in zip(tokens, tokens[1:], strict=False):
        if token.type == "heading_open":
            words = (child.content for child in inline.children or () if child.type in ("text", "code_inline"))
            name = anchor_of("".join(words))
            count = 0
            anchor = name
            while anchor in anchors:
                count += 1
                anchor = f"{name}-{count}"
            anchors.add(anchor)
    return anchors


def links_in(path: Path) -> Iterator[tuple[str, int]]:
    """Targets of links and images, and the lines where their paragraphs begin."""
    for token in parse(path):
        line = token.map[0] + 1 if token.map else 0
        for child in token.children or ():
            target = child.attrGet("href" if child.type == "link_open" else "src")
            if target is not None:
                yield str(target), line


def fault_of(path: Path, target: str) -> str | None:
    """What is wrong with a link of this file."""
    parts = urlsplit(target)
    if parts.scheme or parts.netloc:
        return None
    file = path.parent / unquote(parts.path) if parts.path else path
    if not file.exists():
        return f"{target} does not exist"
    if parts.fragment and (not file.is_file() or unquote(parts.fragment) not in anchors_in(file)):
        return f"{target}: there is no such heading"
    return None


def main() -> int:
    parser = argparse.ArgumentParser(description="check the links of Markdown files within the tree")
    parser.add_argument("file", type=Path, nargs="+")
    arguments = parser.parse_args()
    count = 0
    findings = 0
    try:
        for path in arguments.file:
            for target, line in links_in(path):
                count += 1
                fault = fault_of(path, target)
                if fault is not None:
                    findings += 1
                    print(f"{path}:{line}: {fault}")
    except (OSError, UnicodeDecodeError) as error:
        print(f"check_links: {error}", file=sys.stderr)
        return 2
    print(f"check_links: {count} links, {findings} findings", file=sys.stderr)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
