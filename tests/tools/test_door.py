"""The files that meet a contributor first: they parse, and the tools that they call exist."""

import re
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
    assert "tools/test" in commands
    assert "tools/test " in (ROOT / "README.md").read_text(encoding="utf-8")


def test_hooks_call_tools_that_exist() -> None:
    for repo in load(ROOT / ".pre-commit-config.yaml")["repos"]:
        assert repo["repo"] == "local"  # nothing is fetched from elsewhere
        for hook in repo["hooks"]:
            tool = next(word for word in hook["entry"].split() if word.startswith("tools/"))
            assert (ROOT / tool).is_file(), hook["id"]


def test_the_changelog_has_the_version() -> None:
    project = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    version = re.search(r"^project\(pdcp VERSION (\S+)", project, re.MULTILINE)
    assert version is not None
    headings = re.findall(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert headings[0] == "Unreleased"
    assert version[1] in headings
