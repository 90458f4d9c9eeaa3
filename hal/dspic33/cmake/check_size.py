#!/usr/bin/env python3
"""Prints what an image takes of flash and RAM, and fails when that is more than its budget.

Read from the linker's map (--report-mem), which counts flash as the data sheets do, three bytes an instruction. Exit
status: 0 within the budget, 1 beyond it, 2 no such map.
"""

import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path

TOTAL = re.compile(r'Total "(?P<memory>program|data)" memory used \(bytes\):\s+0x[0-9a-f]+\s+\((?P<bytes>\d+)\)')


@dataclass(frozen=True)
class Memory:
    """One kind of memory: bytes used, and its budget."""

    name: str
    used: int
    budget: int

    @property
    def fits(self) -> bool:
        return self.used <= self.budget

    def __str__(self) -> str:
        excess = "" if self.fits else f", {self.used - self.budget} too many"
        return f"{self.name} {self.used} of {self.budget} bytes, {100 * self.used // self.budget} %{excess}"


def read_totals(text: str) -> dict[str, int]:
    """Bytes of program and data memory, as the linker has them; memory of which nothing is used is not there."""
    totals = {match["memory"]: int(match["bytes"]) for match in TOTAL.finditer(text)}
    if "program" not in totals:
        raise ValueError("no totals in it: link with --report-mem")
    return totals


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("map", type=Path, help="the linker's map")
    parser.add_argument("--flash", type=int, required=True, help="budget in bytes")
    parser.add_argument("--ram", type=int, required=True, help="budget in bytes, stack included")
    parser.add_argument("--stack", type=int, required=True, help="bytes kept for the stack")
    arguments = parser.parse_args()
    try:
        totals = read_totals(arguments.map.read_text(encoding="utf-8", errors="replace"))
    except (OSError, ValueError) as error:
        print(f"check_size: {arguments.map}: {error}", file=sys.stderr)
        return 2
    memories = (
        Memory("flash", totals["program"], arguments.flash),
        Memory(f"RAM with {arguments.stack} of stack", totals.get("data", 0) + arguments.stack, arguments.ram),
    )
    for memory in memories:
        print(f"{arguments.map.stem}: {memory}")
    return 0 if all(memory.fits for memory in memories) else 1


if __name__ == "__main__":
    sys.exit(main())
