"""tools/setup with arguments: it takes none, and installs nothing then."""

import subprocess
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "setup"


def test_help() -> None:
    result = subprocess.run(
        [SCRIPT, "--help"], capture_output=True, text=True, timeout=10
    )
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("usage: tools/setup\n")


def test_unexpected_argument() -> None:
    result = subprocess.run([SCRIPT, "all"], capture_output=True, text=True, timeout=10)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == "setup: unexpected argument all; it takes none\n"
