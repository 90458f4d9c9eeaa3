"""What several tests of the package need."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis.configuration import set_hypothesis_home_dir

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))

from scripted import Script, ScriptedArbitrator  # noqa: E402

# The same examples in every run, and none fails for being slow. For others: --hypothesis-profile=explore.
settings.register_profile("same", deadline=None, database=None, derandomize=True, max_examples=100)
settings.register_profile("explore", deadline=None, database=None, max_examples=5000)
settings.load_profile("same")
set_hypothesis_home_dir(ROOT / "build/hypothesis")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--renew", action="store_true", help="write tests/vectors/*.txt instead of comparing with them")


@pytest.fixture
def arbitrator() -> Iterator[Callable[[Script], ScriptedArbitrator]]:
    """arbitrator(SCRIPT): one that runs until the test ends."""
    made: list[ScriptedArbitrator] = []

    def make(script: Script) -> ScriptedArbitrator:
        made.append(ScriptedArbitrator(script))
        return made[-1]

    yield make
    for each in made:
        each.close()
