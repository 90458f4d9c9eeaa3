"""The anchors that headings of Markdown files have where they are shown."""

import re


def anchor_of(heading: str) -> str:
    """The anchor of a heading that is the first of its name in a file: "4. Parameters" has "4-parameters"."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
