"""hal/dspic33/cmake/check_size.py on maps as the vendor's linker writes them."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "hal/dspic33/cmake/check_size.py"

# The lines that count, of a map written with --report-mem.
PROGRAM = '                 Total "program" memory used (bytes):         0xf1c2  (61890) 94%\n'
DATA = '                 Total "data" memory used (bytes):         0x30f2  (12530) 76%\n'


def check(map_file: Path, flash: int, ram: int) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, str(SCRIPT), "--flash", str(flash), "--ram", str(ram), "--stack", "1792", str(map_file)]
    return subprocess.run(words, capture_output=True, text=True, check=False)


@pytest.fixture
def image(tmp_path: Path) -> Path:
    path = tmp_path / "image.map"
    path.write_text(f"Data Memory\n{DATA}\nProgram Memory\n{PROGRAM}", encoding="utf-8")
    return path


def test_within_the_budget(image: Path) -> None:
    done = check(image, 61890, 14322)
    assert done.returncode == 0
    assert done.stdout.splitlines() == [
        "image: flash 61890 of 61890 bytes, 100 %",
        "image: RAM with 1792 of stack 14322 of 14322 bytes, 100 %",
    ]


def test_a_byte_too_many(image: Path) -> None:
    done = check(image, 61889, 14322)
    assert done.returncode == 1
    assert "image: flash 61890 of 61889 bytes, 100 %, 1 too many" in done.stdout
    assert check(image, 61890, 14321).returncode == 1


def test_no_variables(image: Path) -> None:
    image.write_text(PROGRAM, encoding="utf-8")
    assert "RAM with 1792 of stack 1792 of 1800 bytes" in check(image, 70000, 1800).stdout


def test_no_map(tmp_path: Path) -> None:
    done = check(tmp_path / "absent.map", 1, 1)
    assert done.returncode == 2
    assert "absent.map" in done.stderr


def test_a_map_without_totals(image: Path) -> None:
    image.write_text("Memory Configuration\n", encoding="utf-8")
    done = check(image, 1, 1)
    assert done.returncode == 2
    assert "--report-mem" in done.stderr
