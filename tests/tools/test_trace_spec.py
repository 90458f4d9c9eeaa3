"""tools/trace_spec.py on small trees: what counts as naming a decision, a section or a clause, what it must find, the
tables."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "trace_spec.py"


def d(series: str, number: int) -> str:
    """The name of a decision."""
    return f"D-{series}-{number}"


BUS_1, BUS_2, BUS_3, BUS_4, API_1 = d("BUS", 1), d("BUS", 2), d("BUS", 3), d("BUS", 4), d("API", 1)
ALL = ", ".join((BUS_1, BUS_2, BUS_4, API_1))

CLAUSES = """
[sources.PDCP]
section = ["1", "1.1", "1.2", "1.9", "1.10"]
figure = ["1.1"]
[sources.PROFILE]
table = ["2.8", "2.9", "2.10"]
appendix = ["D"]
"""
BUS_SPEC = f"""# The bus

**{BUS_1}** *One.* The first rule.

## 1. Frames

**{BUS_2}** *Two: of
two.* More.

## 3. Links & more

### 3.1 Making

**{BUS_3}** *Three.* **Not built yet.** Some
day.

**{BUS_4}** *Four.* As {BUS_2} says.
"""
API_SPEC = f"# Hosts\n\n## 1. Frame\n\n**{API_1}** *Hosts.* Text.\n"
HAND_WRITTEN = "# Decisions\n\nA list.\n"
TREE = {
    "docs/clauses.toml": CLAUSES,
    "docs/decisions.md": HAND_WRITTEN,
    "docs/spec/bus.md": BUS_SPEC,
    "docs/spec/host-api.md": API_SPEC,
    "pdcp/a.c": f"/* {ALL} [PDCP 1.1] */\n",
    "tests/unit/test_a.c": f"/* {BUS_1}, -2,\n * -4 */\nint x;\n/* {API_1} */\n",
}


def write_tree(root: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def run(root: Path, *options: str) -> tuple[int, list[str]]:
    command = [sys.executable, str(SCRIPT), *options, str(root)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    return result.returncode, result.stdout.splitlines()


def findings(root: Path, files: dict[str, str]) -> list[str]:
    """What is found in the tree with these files added or replaced, once its tables are up to date."""
    write_tree(root, TREE | files)
    run(root, "--write")
    status, output = run(root)
    assert status == (1 if output else 0)
    return output


def rows(root: Path, name: str) -> list[str]:
    """The rows of all tables that begin with this name: of a decision that of the list and that of its traces."""
    return [line for line in (root / "docs/decisions.md").read_text().splitlines() if line.startswith(f"| {name} |")]


def test_a_tree_in_order_passes(tmp_path: Path) -> None:
    assert findings(tmp_path, {}) == []


def test_the_tables_are_checked_and_renewed(tmp_path: Path) -> None:
    write_tree(tmp_path, TREE)
    status, output = run(tmp_path)
    assert status == 1
    assert len(output) == 1
    assert "not up to date" in output[0]
    assert run(tmp_path, "--write") == (0, [])
    assert run(tmp_path) == (0, [])
    write_tree(tmp_path, {"pdcp/b.c": f"/* {BUS_1} */\n"})
    assert run(tmp_path)[0] == 1


def test_the_hand_written_part_stays(tmp_path: Path) -> None:
    findings(tmp_path, {})
    document = tmp_path / "docs/decisions.md"
    document.write_text(document.read_text().replace("# Decisions", "# Changed") + "\nBehind.\n")
    write_tree(tmp_path, {"pdcp/b.c": f"/* {BUS_2} */\n"})
    assert run(tmp_path, "--write") == (0, [])
    text = document.read_text()
    assert text.startswith(HAND_WRITTEN.replace("# Decisions", "# Changed") + "\n<!--")
    assert text.endswith("-->\n\nBehind.\n")


def test_the_list_points_to_sections(tmp_path: Path) -> None:
    findings(tmp_path, {})
    assert rows(tmp_path, BUS_1)[0] == f"| {BUS_1} | One | [bus.md](spec/bus.md) |"
    assert rows(tmp_path, BUS_2)[0] == f"| {BUS_2} | Two: of two | [bus.md 1](spec/bus.md#1-frames) |"
    assert rows(tmp_path, BUS_3)[0] == f"| {BUS_3} | *Not built yet:* Three | [bus.md 3.1](spec/bus.md#31-making) |"
    assert rows(tmp_path, API_1)[0] == f"| {API_1} | Hosts | [host-api.md 1](spec/host-api.md#1-frame) |"


def test_rows_name_code_and_tests(tmp_path: Path) -> None:
    findings(tmp_path, {"firmware/b.h": f"// {BUS_1}\n", "tests/sim/test_b.py": f"# {BUS_1}\n"})
    assert rows(tmp_path, BUS_1)[1] == f"| {BUS_1} | firmware/: b.h; pdcp/: a.c | sim/: test_b.py; unit/: test_a.c |"
    assert rows(tmp_path, BUS_3)[1] == f"| {BUS_3} | | |"
    assert rows(tmp_path, "PDCP 1.1") == ["| PDCP 1.1 | pdcp/: a.c | |"]


def test_what_is_built_needs_a_test(tmp_path: Path) -> None:
    output = findings(tmp_path, {"tests/unit/test_a.c": f"/* {BUS_1}, -4, {API_1} */\n"})
    assert output == [f"{BUS_2} is named by no test: Two: of two"]


def test_what_is_built_needs_code(tmp_path: Path) -> None:
    output = findings(tmp_path, {"pdcp/a.c": f"/* {BUS_1}, -2, {API_1} */\n"})
    assert output == [f"{BUS_4} is named by no code: Four"]


def test_a_document_is_neither_code_nor_test(tmp_path: Path) -> None:
    files = {"pdcp/a.c": f"/* {BUS_1}, -2, {API_1} */\n", "pdcp/README.md": BUS_4, "tests/README.md": BUS_4}
    assert findings(tmp_path, files) == [f"{BUS_4} is named by no code: Four"]


@pytest.mark.parametrize("mark", ["Not built yet", "Built in part", "Not built\nyet"])
def test_what_is_put_off_needs_neither(tmp_path: Path, mark: str) -> None:
    text = API_SPEC + f"\n**{d('API', 2)}** *Later.* **{mark}.** Text.\n"
    assert findings(tmp_path, {"docs/spec/host-api.md": text}) == []


def test_a_range_in_a_test_is_no_test(tmp_path: Path) -> None:
    output = findings(tmp_path, {"tests/unit/test_a.c": f"/* {BUS_1} to -4, {API_1} */\n"})
    assert [line.split()[0] for line in output] == [BUS_1, BUS_2, BUS_4]


def test_a_range_in_code_names_all(tmp_path: Path) -> None:
    assert findings(tmp_path, {"pdcp/a.c": f"/* {BUS_1} to -4, {API_1} */\n"}) == []
    assert rows(tmp_path, BUS_2)[1] == f"| {BUS_2} | pdcp/: a.c | unit/: test_a.c |"


def test_tests_of_tools_do_not_count(tmp_path: Path) -> None:
    files = {"tests/unit/test_a.c": f"/* {BUS_1}, -4, {API_1} */\n", "tests/tools/test_b.py": f"# {BUS_2}\n"}
    assert findings(tmp_path, files) == [f"{BUS_2} is named by no test: Two: of two"]


@pytest.mark.parametrize(
    "path",
    [
        *("pdcp/b.c", "tests/sim/b.c", "tools/script", "tests/vectors/b.log", "docs/b.md", "docs/spec/b.toml"),
        *("CHANGELOG.md", "tools/b/c.md"),
    ],
)
def test_a_decision_that_does_not_exist_is_found(tmp_path: Path, path: str) -> None:
    output = findings(tmp_path, {path: f"#\n# {d('BUS', 2)} and\n# -5, {d('SIM', 1)}\n"})
    assert output == [f"{path}:2: {d('BUS', 5)} does not exist", f"{path}:3: {d('SIM', 1)} does not exist"]


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("bus.md 1", []),
        ("bus.md 3.1", []),
        ("bus.md 1 and 3", []),
        ("bus.md 1 to 3.1, {bus_1}", []),
        ("bus.md 1\n * and 3.1", []),
        ("bus.md", []),
        ("bus.md, of 7", []),
        ("bus.md 1: 5, 6 and 8", []),
        ("bus.md 1 (240A)", []),
        ("bus.md 240Ah", []),
        ("bus.md 2", ["bus.md 2"]),
        ("bus.md 3.2", ["bus.md 3.2"]),
        ("bus.md 1, 3 and 31", ["bus.md 31"]),
        ("bus.md 1 to 9", ["bus.md 9"]),
        ("host-api.md 1 and bus.md 5.", ["bus.md 5"]),
        ("bus-api.md 1", ["bus-api.md 1"]),
    ],
)
def test_sections(tmp_path: Path, text: str, missing: list[str]) -> None:
    text = text.format(bus_1=BUS_1)
    output = findings(tmp_path, {"profile/b.c": f"\n/* As {text} */\n"})
    assert output == [f"profile/b.c:2: {name} does not exist" for name in missing]


def test_a_section_is_a_numbered_heading(tmp_path: Path) -> None:
    text = BUS_SPEC.replace("## 1. Frames", "1. Frames")
    output = findings(tmp_path, {"docs/spec/bus.md": text, "pdcp/b.c": "// bus.md 1\n"})
    assert output == ["pdcp/b.c:1: bus.md 1 does not exist"]


def test_a_section_that_is_there_twice_is_found(tmp_path: Path) -> None:
    output = findings(tmp_path, {"docs/spec/bus.md": BUS_SPEC + "\n## 3. Again\n"})
    assert output == ["docs/spec/bus.md: section 3 is there twice"]


@pytest.mark.parametrize(
    ("inside", "missing"),
    [
        ("PDCP 1.3", ["PDCP section 1.3"]),
        ("PDCP 1.2, 1.3", ["PDCP section 1.3"]),
        ("PDCP 1, 1.10", []),
        ("PDCP figure 1.1", []),
        ("PDCP figure 1.2", ["PDCP figure 1.2"]),
        ("PDCP table 1.1", ["PDCP table 1.1"]),
        ("PDCP figure 1.1, 1.2", []),
        ("PROFILE tables 2.8 and 2.9", []),
        ("PROFILE tables 2.8 to 2.10", []),
        ("PROFILE tables 2.8 to 2.11", ["PROFILE table 2.11"]),
        ("PROFILE tables 2.8\n * and 2.9", []),
        ("PROFILE table 2.8, 2.9", ["PROFILE section 2.9"]),
        ("PROFILE appendix D", []),
        ("PDCP chapter 1", []),
        ("PDCP somewhere", ["PDCP somewhere"]),
        ("PDCP", []),
        ("PDCP_MAX", []),
        ("API 1", ["API section 1"]),
    ],
)
def test_clauses(tmp_path: Path, inside: str, missing: list[str]) -> None:
    output = findings(tmp_path, {"profile/b.c": f"\n/* [{inside}] */\n"})
    assert output == [f"profile/b.c:2: [{name}] does not exist" for name in missing]


def test_clauses_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    findings(tmp_path, {"pdcp/b.c": "/* [PDCP 1.10, 1.9, 1.2] */\n"})
    lines = (tmp_path / "docs/decisions.md").read_text().splitlines()
    numbers = [line.split()[2] for line in lines if line.startswith("| PDCP")]
    assert numbers == ["1.1", "1.2", "1.9", "1.10"]


def test_a_decision_written_down_twice_is_found(tmp_path: Path) -> None:
    output = findings(tmp_path, {"docs/spec/host-api.md": API_SPEC + f"\n**{BUS_1}** *Again.* Text.\n"})
    assert output == [f"docs/spec/host-api.md:7: {BUS_1} is there twice"]


def test_a_decision_needs_a_title(tmp_path: Path) -> None:
    output = findings(tmp_path, {"docs/spec/host-api.md": API_SPEC + f"\n**{d('API', 2)}** No title.\n"})
    assert f"docs/spec/host-api.md:7: {d('API', 2)} has no title" in output


def test_a_specification_without_decisions_is_an_error(tmp_path: Path) -> None:
    write_tree(tmp_path, TREE | {"docs/spec/bus.md": "# Nothing\n", "docs/spec/host-api.md": ""})
    assert run(tmp_path)[0] == 2


@pytest.mark.parametrize("missing", ["docs/clauses.toml", "docs/decisions.md"])
def test_missing_files_are_an_error(tmp_path: Path, missing: str) -> None:
    write_tree(tmp_path, TREE)
    (tmp_path / missing).unlink()
    assert run(tmp_path)[0] == 2


def test_a_tree_without_sources_is_an_error(tmp_path: Path) -> None:
    write_tree(tmp_path, {name: text for name, text in TREE.items() if name.startswith("docs/")})
    assert run(tmp_path)[0] == 2


def test_a_mark_that_is_missing_is_an_error(tmp_path: Path) -> None:
    findings(tmp_path, {})
    document = tmp_path / "docs/decisions.md"
    document.write_text("\n".join(document.read_text().splitlines()[:-1]) + "\n")
    assert run(tmp_path, "--write")[0] == 2
