"""The files that meet a contributor first: they parse, what they name exists, and what is said twice is the same."""

import configparser
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
GITHUB = ROOT / ".github"
FORMS = sorted(form for form in (GITHUB / "ISSUE_TEMPLATE").glob("*.yml") if form.name != "config.yml")


def load(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return content


def only_match(pattern: str, path: str) -> str:
    """The group of the pattern, which this file must match once."""
    [found] = re.finditer(pattern, (ROOT / path).read_text(encoding="utf-8"), re.MULTILINE)
    return str(found[1])


@pytest.mark.parametrize(
    "path", [ROOT / ".pre-commit-config.yaml", *sorted(GITHUB.rglob("*.yml"))], ids=lambda p: p.name
)
def test_it_is_yaml(path: Path) -> None:
    assert isinstance(load(path), dict)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: str(form.stem))
def test_an_issue_form_asks_something(form: Path) -> None:
    body = load(form)["body"]
    questions = [field for field in body if field["type"] != "markdown"]
    assert len(questions) >= 1
    assert len({field["id"] for field in questions}) == len(questions)
    assert all(field["attributes"]["label"] for field in questions)


def test_the_workflow_runs_what_the_readme_says() -> None:
    workflow = load(GITHUB / "workflows" / "test.yml")
    assert workflow["permissions"] == {"contents": "read"}
    commands = [step.get("run") for step in workflow["jobs"]["test"]["steps"]]
    assert commands.index("tools/setup") < commands.index("tools/test")
    assert "tools/test " in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_workflow_uses_two_actions_by_their_major_version() -> None:
    steps = load(GITHUB / "workflows" / "test.yml")["jobs"]["test"]["steps"]
    used = [step["uses"] for step in steps if "uses" in step]
    assert [action.partition("@")[0] for action in used] == ["actions/checkout", "actions/upload-artifact"]
    assert all(re.fullmatch(r"v[0-9]+", action.partition("@")[2]) for action in used)


def test_hooks_call_tools_that_exist() -> None:
    for repo in load(ROOT / ".pre-commit-config.yaml")["repos"]:
        assert repo["repo"] == "local"  # nothing is fetched from elsewhere
        for hook in repo["hooks"]:
            tool = next(word for word in hook["entry"].split() if word.startswith("tools/"))
            assert (ROOT / tool).is_file(), hook["id"]


def test_the_guide_names_files_that_exist() -> None:
    guide = (GITHUB / "CONTRIBUTING.md").read_text(encoding="utf-8")
    tops = {path.name for path in ROOT.iterdir()} - {"build"}
    named = {word for code in re.findall(r"`([^`\n]+)`", guide) for word in code.split() if word.split("/")[0] in tops}
    assert len(named) > 20
    assert [name for name in sorted(named) if not (ROOT / name).exists()] == []


def test_editors_have_the_widths_that_the_checks_hold() -> None:
    editor = configparser.ConfigParser()
    editor.read_string("[top]\n" + (ROOT / ".editorconfig").read_text(encoding="utf-8"))
    assert editor["*.{c,h}"]["max_line_length"] == only_match(r"^ColumnLimit: (\d+)$", ".clang-format")
    assert editor["*"]["indent_size"] == only_match(r"^IndentWidth: (\d+)$", ".clang-format")
    package = tomllib.loads((ROOT / "tools/pdcp/pyproject.toml").read_text(encoding="utf-8"))
    assert int(editor["*.py"]["max_line_length"]) == package["tool"]["ruff"]["line-length"]
    extended = tomllib.loads((ROOT / ".ruff.toml").read_text(encoding="utf-8"))
    assert extended == {"extend": "tools/pdcp/pyproject.toml"}  # one set of rules for all files


def test_the_version_is_one() -> None:
    version = only_match(r"^project\(pdcp VERSION (\d+\.\d+\.\d+) ", "CMakeLists.txt")
    header = "firmware/arb_version.h"
    assert version == ".".join(
        only_match(rf"ARB_VERSION_{part} = (\d+)", header) for part in ("MAJOR", "MINOR", "PATCH")
    )
    assert version == only_match(r'^__version__ = "(.+)"$', "tools/pdcp/src/pdcp/__init__.py")
    headings = re.findall(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert headings[:2] == ["Unreleased", version]
