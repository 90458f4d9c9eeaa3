"""tools/results.py, and what tools/test makes of it, on results as ctest writes them."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tools/results.py"

CASES = """\
<testcase name="unit.a" classname="unit.a" time="1.25" status="run"/>
<testcase name="unit.b" classname="unit.b" time="0.5" status="fail"><failure message=""/></testcase>
<testcase name="sim.c" classname="sim.c" time="20" status="run"/>
<testcase name="both" classname="both" time="100" status="run"/>
<testcase name="bare" classname="bare" time="3" status="notrun"><skipped message="SKIP_RETURN_CODE=77"/></testcase>
<testcase name="off" classname="off" time="0" status="disabled"/>
<testcase name="gone" classname="gone" time="0" status="notrun"><skipped message="No such executable"/></testcase>
"""
LABELS = {"unit.a": ["unit"], "unit.b": ["unit"], "sim.c": ["sim"], "both": ["unit", "sim"], "elsewhere": ["vm"]}


def write_results(path: Path, text: str = CASES) -> Path:
    path.write_text(f"<?xml version='1.0'?>\n<testsuite name='x'>\n{text}</testsuite>\n", encoding="utf-8")
    return path


def write_tests(path: Path) -> Path:
    """As ctest --show-only=json-v1 tells them; some have no properties at all."""
    tests: list[dict[str, object]] = [
        {"name": name, "properties": [{"name": "TIMEOUT", "value": 9.0}, {"name": "LABELS", "value": labels}]}
        for name, labels in LABELS.items()
    ]
    path.write_text(json.dumps({"kind": "ctestInfo", "tests": [*tests, {"name": "bare"}]}), encoding="utf-8")
    return path


def run(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, str(SCRIPT), *words], capture_output=True, text=True, check=False)


def rows(output: str) -> list[list[str]]:
    return [line.split() for line in output.splitlines()]


def test_count(tmp_path: Path) -> None:
    """Skipped on purpose or switched off is skipped; a program that is missing has failed."""
    done = run("count", str(write_results(tmp_path / "results-default.xml")))
    assert (done.returncode, done.stdout, done.stderr) == (0, "3 2 2\n", "")


def test_times_of_one_run(tmp_path: Path) -> None:
    """A test counts for each of its labels, and once in all; labels without a test that ran are left out."""
    pair = f"{write_results(tmp_path / 'results-default.xml')}={write_tests(tmp_path / 'tests.json')}"
    done = run("times", pair)
    assert (done.returncode, done.stderr) == (0, "")
    assert rows(done.stdout) == [
        ["default"],
        ["label", "tests", "seconds"],
        ["none", "3", "3.0"],
        ["sim", "2", "120.0"],
        ["unit", "3", "101.8"],
        ["all", "7", "124.8"],
    ]


def test_times_of_two_runs(tmp_path: Path) -> None:
    """A column for each, with room where it has no such label, and one for all."""
    tests = write_tests(tmp_path / "tests.json")
    first = write_results(tmp_path / "results-default.xml")
    second = write_results(tmp_path / "results-asan.xml", '<testcase name="unit.a" time="2.5" status="run"/>\n')
    done = run("times", f"{first}={tests}", f"{second}={tests}")
    assert rows(done.stdout)[0] == ["default", "asan", "all"]
    assert ["sim", "2", "120.0", "2", "120.0"] in rows(done.stdout)
    assert ["unit", "3", "101.8", "1", "2.5", "4", "104.2"] in rows(done.stdout)
    assert rows(done.stdout)[-1] == ["all", "7", "124.8", "1", "2.5", "8", "127.2"]
    lines = done.stdout.splitlines()
    assert len({len(line) for line in lines}) == 1, "columns stand below each other"


@pytest.mark.parametrize("words", [[], ["count"], ["times"], ["times", "a.xml"], ["other", "a.xml"]])
def test_wrong_use(words: list[str]) -> None:
    assert run(*words).returncode == 2


def test_no_results(tmp_path: Path) -> None:
    assert run("count", str(tmp_path / "absent.xml")).returncode == 1
    (tmp_path / "cut.xml").write_text("<testsuite>", encoding="utf-8")
    done = run("count", str(tmp_path / "cut.xml"))
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1


CTEST = """\
#!/bin/sh
for word; do
    case $word in
    --show-only=*) cat "$FOLDER/tests.json"; exit 0 ;;
    /*/results-*.xml) cp "$FOLDER/ctest.xml" "$word" ;;
    esac
done
exit "$CTEST_STATUS"
"""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """tools/test in a tree of its own, where setup and cmake do nothing, and ctest leaves the results above."""
    (tmp_path / "tools").mkdir()
    (tmp_path / "bin").mkdir()
    (tmp_path / "build/venv/bin").mkdir(parents=True)
    (tmp_path / "build/venv/bin/python").symlink_to(sys.executable)
    for name in ("test", "results.py"):
        shutil.copy(ROOT / "tools" / name, tmp_path / "tools")
    stubs = {"tools/setup": "#!/bin/sh\n", "bin/cmake": "#!/bin/sh\n", "bin/ctest": CTEST}
    for stub, text in stubs.items():
        (tmp_path / stub).write_text(text, encoding="utf-8")
        (tmp_path / stub).chmod(0o755)
    write_tests(tmp_path / "tests.json")
    return tmp_path


def run_tools_test(tree: Path, ctest_status: int) -> tuple[int, list[str]]:
    path = f"{tree / 'bin'}:{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "FOLDER": str(tree), "CTEST_STATUS": str(ctest_status)}
    done = subprocess.run(
        [tree / "tools/test"], capture_output=True, text=True, env=environment, check=False, stdin=subprocess.DEVNULL
    )
    return done.returncode, done.stdout.splitlines()


def test_the_end_of_tools_test(tree: Path) -> None:
    """The table, the time of the whole, and the counts of both presets in the last line."""
    write_results(tree / "ctest.xml")
    status, lines = run_tools_test(tree, 8)
    assert (status, lines[-1]) == (1, "6 passed, 4 failed, 4 skipped")
    assert re.fullmatch(r"The whole took \d+ min \d+ s; \d+ tests ran at a time\.", lines[-2])
    assert lines[-3].split() == ["all", "7", "124.8", "7", "124.8", "14", "249.5"]
    assert lines[lines.index("test: time by label") + 1].split() == ["default", "asan", "all"]


def test_tools_test_when_all_pass(tree: Path) -> None:
    write_results(tree / "ctest.xml", '<testcase name="unit.a" time="1" status="run"/>\n')
    status, lines = run_tools_test(tree, 0)
    assert (status, lines[-1]) == (0, "2 passed, 0 failed, 0 skipped")


def test_tools_test_without_results(tree: Path) -> None:
    """Each preset counts as one failure, and there is no table."""
    status, lines = run_tools_test(tree, 1)
    assert (status, lines[-1]) == (1, "0 passed, 2 failed, 0 skipped")
    assert "test: time by label" not in lines
