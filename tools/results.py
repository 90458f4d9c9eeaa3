#!/usr/bin/env python3
"""What ctest has found, for tools/test: counts of a run, and a table of the time by label.

    results.py count RESULTS.xml              prints PASSED FAILED SKIPPED
    results.py times RESULTS.xml=TESTS.json...  prints the table, a column for each run, named like its RESULTS

RESULTS.xml is written by ctest --output-junit, TESTS.json by ctest --show-only=json-v1: only that knows labels.
Exit status: 0 done, 1 a file cannot be read, 2 wrong use.
"""

import json
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

ALL = "all"
NO_LABEL = "none"


class Counts(NamedTuple):
    passed: int
    failed: int
    skipped: int


class Share(NamedTuple):
    """Of the tests with one label."""

    tests: int
    seconds: float


Run = dict[str, Share]  # by label; ALL: each test once


def add(run: Run, label: str, share: Share) -> None:
    tests, seconds = run.get(label, (0, 0.0))
    run[label] = Share(tests + share.tests, seconds + share.seconds)


def cases(results: Path) -> list[ElementTree.Element]:
    return list(ElementTree.parse(results).getroot().iter("testcase"))


def count(results: Path) -> Counts:
    """A test that is neither done nor skipped on purpose, such as one whose program is missing, has failed."""
    passed = failed = skipped = 0
    for case in cases(results):
        reason = case.find("skipped")
        if case.get("status") == "run":
            passed += 1
        elif case.get("status") == "disabled" or (reason is not None and reason.get("message", "").startswith("SKIP_")):
            skipped += 1
        else:
            failed += 1
    return Counts(passed, failed, skipped)


def labels_of(tests: Path) -> dict[str, list[str]]:
    """The labels of each test."""
    found: dict[str, list[str]] = {}
    for test in json.loads(tests.read_text(encoding="utf-8"))["tests"]:
        values = [each["value"] for each in test.get("properties", []) if each["name"] == "LABELS"]
        found[test["name"]] = values[0] if values else []
    return found


def times(results: Path, tests: Path) -> Run:
    labels = labels_of(tests)
    run: Run = {}
    for case in cases(results):
        share = Share(1, float(case.get("time", 0)))
        for label in (*(labels.get(case.get("name", "")) or [NO_LABEL]), ALL):
            add(run, label, share)
    return run


def in_all(runs: Sequence[Run]) -> Run:
    found: Run = {}
    for run in runs:
        for label, share in run.items():
            add(found, label, share)
    return found


def table(runs: dict[str, Run]) -> list[str]:
    """A line for each label, the last for all; a column for each run, and one for all if there are several."""
    total = in_all(list(runs.values()))
    columns = runs | {ALL: total} if len(runs) > 1 else runs
    width = max(len("label"), *(len(label) for label in total))
    lines = [
        " " * width + "".join(f"{name:>18}" for name in columns),
        f"{'label':<{width}}" + f"{'tests':>9}{'seconds':>9}" * len(columns),
    ]
    for label in [*sorted(total.keys() - {ALL}), *(total.keys() & {ALL})]:
        shares = [run.get(label) for run in columns.values()]
        cells = (" " * 18 if share is None else f"{share.tests:>9}{share.seconds:>9.1f}" for share in shares)
        lines.append(f"{label:<{width}}" + "".join(cells))
    return [line.rstrip() for line in lines]


def main(arguments: Sequence[str]) -> int:
    match arguments:
        case ["count", results]:
            print(*count(Path(results)))
        case ["times", *pairs] if pairs and all("=" in pair for pair in pairs):
            files = [(Path(results), Path(tests)) for results, _, tests in (pair.partition("=") for pair in pairs)]
            runs = {results.stem.removeprefix("results-"): times(results, tests) for results, tests in files}
            print("\n".join(table(runs)))
        case _:
            print("results: wrong use; see the beginning of the file", file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except (OSError, ElementTree.ParseError, json.JSONDecodeError) as error:
        print(f"results: {error}", file=sys.stderr)
        sys.exit(1)
