"""tools/flash with stand-ins for the vendor's programs: what runs, what a serial number changes, its errors."""

import os
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "flash"
END = ":00000001FF\n"
IMAGE = ":020000040000FA\n:0400000012000400E6\n" + END
FAKE = """#!/bin/sh
printf '%s\\n' "$@" > "$FLASH_LOG"
for argument; do
    case $argument in
    -F*) cp "${argument#-F}" "$FLASH_LOG.hex" ;;
    */script) cp "$argument" "$FLASH_LOG.script" ;;
    esac
done
echo "${FLASH_SAYS-Program Succeeded.}"
exit "${FLASH_STATUS-0}"
"""


@pytest.fixture
def image(tmp_path: Path) -> Path:
    folder = tmp_path / "dspic33fj64mc802" / "bin"
    folder.mkdir(parents=True)
    path = folder / "pdcp-arbitrator.hex"
    path.write_text(IMAGE, encoding="ascii")
    return path


def install(root: Path, *names: str) -> None:
    for name in names:
        path = root / "mplab_platform" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(FAKE, encoding="ascii")
        path.chmod(0o755)


def run(root: Path, *arguments: str | Path, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"MPLABX_ROOT": str(root), "FLASH_LOG": str(root / "log")} | variables
    return subprocess.run([SCRIPT, *arguments], capture_output=True, text=True, check=False, env=environment)


def hex_bytes(text: str) -> dict[int, int]:
    """The bytes of an Intel HEX file by address; every record's checksum is right."""
    base = 0
    found: dict[int, int] = {}
    for line in text.split():
        record = bytes.fromhex(line[1:])
        assert sum(record) & 0xFF == 0, line
        assert record[0] == len(record) - 5, line
        if record[3] == 4:
            base = int.from_bytes(record[4:6], "big") << 16
        elif record[3] == 0:
            at = base + int.from_bytes(record[1:3], "big")
            found |= {at + i: value for i, value in enumerate(record[4:-1])}
    return found


def test_ipecmd(tmp_path: Path, image: Path) -> None:
    install(tmp_path, "mplab_ipe/ipecmd.sh", "bin/mdb.sh")
    result = run(tmp_path, image)
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "log").read_text().split() == ["-TPPK4", "-P33FJ64MC802", f"-F{image}", "-M", "-OL"]
    assert result.stdout.splitlines()[-1] == "flash: programmed dsPIC33FJ64MC802"


def test_mdb_where_ipecmd_is_missing(tmp_path: Path, image: Path) -> None:
    install(tmp_path, "bin/mdb.sh")
    image = image.rename(tmp_path / "moved.hex")
    result = run(tmp_path, "--tool", "pickit3", "--part", "33EP512MU810", image)
    assert result.returncode == 0, result.stderr
    script = (tmp_path / "log.script").read_text().splitlines()
    assert script == ["device dsPIC33EP512MU810", "hwtool pickit3 -p", f'program "{image}"', "quit"]


@pytest.mark.parametrize(("part", "address"), [("33FJ64MC802", 0xA800), ("33EP512MU810", 0x54800)])
def test_serial_number(tmp_path: Path, image: Path, part: str, address: int) -> None:
    """The low words of the instructions at an address, which counts two bytes; the rest of the image stays."""
    install(tmp_path, "mplab_ipe/ipecmd.sh")
    image = image.rename(tmp_path / "moved.hex")
    result = run(tmp_path, "--serial", str(0x89ABCDEF), "--part", part, image)
    assert result.returncode == 0, result.stderr
    text = (tmp_path / "log.hex").read_text()
    assert text.endswith(END)
    assert text.count(END) == 1
    serial = bytes.fromhex("EFCD0000AB890000")
    assert hex_bytes(text) == hex_bytes(IMAGE) | {2 * address + i: value for i, value in enumerate(serial)}


def test_part_of_another_folder(tmp_path: Path, image: Path) -> None:
    install(tmp_path, "mplab_ipe/ipecmd.sh")
    result = run(tmp_path, "--part", "33EP512MU810", image)
    assert (result.returncode, result.stdout) == (2, "")
    assert "dspic33fj64mc802" in result.stderr and "--part 33EP512MU810" in result.stderr


def test_image_without_data(tmp_path: Path, image: Path) -> None:
    image.write_text(END, encoding="ascii")
    result = run(tmp_path, image)
    assert (result.returncode, result.stdout) == (2, "")
    assert "without any data" in result.stderr


def test_dry_run_with_nothing_installed(tmp_path: Path, image: Path) -> None:
    result = run(tmp_path, "--dry-run", image, MPLABX_ROOT="", PATH="/usr/bin:/bin")
    assert result.returncode == 0, result.stderr
    assert result.stdout == f"ipecmd.sh -TPPK4 -P33FJ64MC802 -F{image} -M -OL\n"
    assert "neither ipecmd.sh nor mdb.sh was found" in result.stderr


@pytest.mark.parametrize("variables", [{"FLASH_STATUS": "36"}, {"FLASH_SAYS": "Target not found"}])
def test_programmer_failed(tmp_path: Path, image: Path, variables: dict[str, str]) -> None:
    install(tmp_path, "mplab_ipe/ipecmd.sh")
    result = run(tmp_path, image, **variables)
    assert result.returncode == 1
    assert "not programmed" in result.stderr


def test_nothing_installed(tmp_path: Path, image: Path) -> None:
    result = run(tmp_path, image)
    assert (result.returncode, result.stderr.count("\n")) == (1, 1)
    assert "neither ipecmd.sh nor mdb.sh was found" in result.stderr
    install(tmp_path, "bin/mdb.sh")
    assert "needs ipecmd.sh" in run(tmp_path, "--tool", "onboard", image).stderr


def test_wrong_root_is_named(tmp_path: Path, image: Path) -> None:
    root = tmp_path / "v6.00"
    assert f"not in MPLABX_ROOT={root}" in run(root, image).stderr


@pytest.mark.parametrize(
    ("tool", "code"),
    [("pickit3", "PK3"), ("pickit4", "PK4"), ("pickit5", "PK5"), ("snap", "SNAP"), ("onboard", "PKOB")],
)
def test_tools(tmp_path: Path, image: Path, tool: str, code: str) -> None:
    install(tmp_path, "mplab_ipe/ipecmd.sh")
    assert run(tmp_path, "--tool", tool, image).returncode == 0
    assert (tmp_path / "log").read_text().split()[0] == f"-TP{code}"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "no image"),
        (["a.hex", "b.hex"], "one image at a time"),
        (["missing.hex"], "missing.hex: cannot be read"),
        (["cut.hex"], "cut.hex: no Intel HEX file"),
        (["whole.hex"], "say --part"),
        (["--part", "33FJ128MC802", "whole.hex"], "part '33FJ128MC802'"),
        (["--tool", "icd2", "whole.hex", "--part", "33FJ64MC802"], "tool 'icd2'"),
        (["--serial", "4294967295", "whole.hex", "--part", "33FJ64MC802"], "serial number '4294967295'"),
        (["--serial", "08", "whole.hex", "--part", "33FJ64MC802"], "serial number '08'"),
        (["--serial"], "--serial wants a value"),
        (["--serial", "", "whole.hex", "--part", "33FJ64MC802"], "--serial wants a value"),
        (["."], ".: cannot be read"),
        (["--fast", "whole.hex"], "unexpected argument '--fast'"),
    ],
)
def test_wrong_use(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "whole.hex").write_text(IMAGE, encoding="ascii")
    (tmp_path / "cut.hex").write_text(IMAGE.removesuffix(END), encoding="ascii")
    install(tmp_path, "mplab_ipe/ipecmd.sh")
    result = run(tmp_path, *arguments)
    assert result.returncode == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "log").exists()


def test_dry_run(tmp_path: Path, image: Path) -> None:
    install(tmp_path, "mplab_ipe/ipecmd.sh")
    result = run(tmp_path, "--dry-run", "--tool", "onboard", image)
    assert result.returncode == 0
    assert "ipecmd.sh -TPPKOB -P33FJ64MC802 -F" in result.stdout
    assert not (tmp_path / "log").exists()
