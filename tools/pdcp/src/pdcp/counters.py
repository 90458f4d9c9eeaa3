"""Names of the arbitrator's counters (2413h), in its order."""

from collections.abc import Sequence
from typing import NamedTuple

from .model import Counter, Stats
from .protocol import COUNTERS


class Group(NamedTuple):
    """A group of counters: its name, and name and meaning of each counter."""

    name: str
    counters: tuple[tuple[str, str], ...]


GROUPS = tuple(Group(name, counters) for name, counters in COUNTERS)
BUS, HOST, STORAGE, DRIVERS = GROUPS


def name_counters(group: int, values: Sequence[int]) -> Stats:
    """Puts names to the counters of a group. An arbitrator may have more, or fewer, than this package knows."""
    known = GROUPS[group] if group < len(GROUPS) else Group(f"group {group}", ())
    counters = []
    for at, value in enumerate(values):
        name, text = known.counters[at] if at < len(known.counters) else (f"counter_{at}", "")
        counters.append(Counter(name, value, text))
    return Stats(group, known.name, tuple(counters))
