"""tools/check_links.py on small trees: which links of Markdown files it finds, and which of them are wrong."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "check_links.py"

OTHER = """# Other file

## 4. Parameters & `values`

## Again

## Again

```
## In code
```
"""


def run(root: Path, text: str) -> tuple[int, list[str]]:
    """Checks docs/a.md with this text, beside docs/other.md and a folder docs/spec."""
    (root / "docs/spec").mkdir(parents=True)
    (root / "docs/other.md").write_text(OTHER)
    (root / "docs/a.md").write_text(text)
    command = [sys.executable, str(SCRIPT), "docs/a.md"]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=root)
    return result.returncode, result.stdout.splitlines()


@pytest.mark.parametrize(
    "target",
    [
        "other.md",
        "./other.md",
        "../docs/other.md",
        "spec",
        "spec/",
        "other.md#other-file",
        "other.md#4-parameters--values",
        "other.md#again",
        "other.md#again-1",
        "#here",
        "https://example.org/nothing.md#at-all",
        "mailto:nobody@example.org",
    ],
)
def test_links_that_lead_somewhere(tmp_path: Path, target: str) -> None:
    assert run(tmp_path, f"# Here\n\nSee [it]({target}).\n") == (0, [])


@pytest.mark.parametrize(
    ("target", "fault"),
    [
        ("missing.md", "does not exist"),
        ("missing.md#other-file", "does not exist"),
        ("../other.md", "does not exist"),
        ("other.md#missing", "no such heading"),
        ("other.md#again-2", "no such heading"),
        ("other.md#in-code", "no such heading"),
        ("spec#missing", "no such heading"),
        ("#missing", "no such heading"),
    ],
)
def test_links_that_lead_nowhere(tmp_path: Path, target: str, fault: str) -> None:
    status, output = run(tmp_path, f"# Here\n\nSee [it]({target}).\n")
    assert status == 1
    assert len(output) == 1
    assert output[0].startswith(f"docs/a.md:3: {target}")
    assert fault in output[0]


@pytest.mark.parametrize(
    "text",
    [
        "[it](missing.md)",
        "![a picture](missing.md)",
        "[it][1]\n\n[1]: missing.md",
        "- [it](missing.md)",
        "| [it](missing.md) |\n| --- |",
        "| a |\n| --- |\n| [it](missing.md) |",
        "## [it](missing.md)",
        "[`it`](missing.md 'title')",
    ],
)
def test_every_kind_of_link_is_found(tmp_path: Path, text: str) -> None:
    assert run(tmp_path, text + "\n")[0] == 1


@pytest.mark.parametrize("text", ["`[it](missing.md)`", "```\n[it](missing.md)\n```", "[PDCP 3.1] (none)"])
def test_what_is_no_link(tmp_path: Path, text: str) -> None:
    assert run(tmp_path, text + "\n") == (0, [])


def test_a_file_that_is_missing_is_an_error(tmp_path: Path) -> None:
    command = [sys.executable, str(SCRIPT), str(tmp_path / "missing.md")]
    assert subprocess.run(command, capture_output=True, check=False).returncode == 2
