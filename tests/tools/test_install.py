"""What an operator installs: the programs alone, built without what the tests need (README.md)."""

import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
VERSION_TIMEOUT_S = 10.0


def run(*words: str | Path) -> None:
    result = subprocess.run(words, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr


def test_the_programs_are_built_and_installed_without_the_tests(tmp_path: Path) -> None:
    build, prefix = tmp_path / "build", tmp_path / "prefix"
    run("cmake", "-S", ROOT, "-B", build, "-G", "Ninja", "-DBUILD_TESTING=OFF", f"-DCMAKE_INSTALL_PREFIX={prefix}")
    run("cmake", "--build", build)
    run("cmake", "--install", build)
    assert sorted(path.name for path in prefix.rglob("*") if path.is_file()) == ["pdcp-node", "pdcpd"]
    for name in ("pdcpd", "pdcp-node"):
        done = subprocess.run(
            [prefix / "bin" / name, "--version"], capture_output=True, text=True, check=True, timeout=VERSION_TIMEOUT_S
        )
        assert done.stdout.startswith(f"{name} ")
