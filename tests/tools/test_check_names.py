"""tools/check_names.py on small trees."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "check_names.py"


def run_check(root: Path, path: str, text: str) -> tuple[int, list[str]]:
    """Exit status and output lines for a tree of this one file."""
    file = root / path
    file.parent.mkdir(parents=True)
    file.write_text(text, encoding="utf-8")
    result = subprocess.run([sys.executable, SCRIPT, root], capture_output=True, text=True, check=False)
    return result.returncode, result.stdout.splitlines()


@pytest.mark.parametrize(
    ("path", "function"),
    [
        ("pdcp/common/pdcp_txq.c", "void pdcp_txq_init(int a)"),
        ("pdcp/common/pdcp_bits.c", "void pdcp_bit_set(int a)"),
        ("pdcp/common/pdcp_txq.c", "static void shift(int a)"),
        ("pdcp/common/pdcp_txq.c", "static unsigned\nlong shift(int a)"),
        ("hal/dspic33/ecan1.c", "PART_INLINE void shift(int a)"),
        ("hal/dspic33/ecan1.c", "bool hal_can_send(int a)"),
        ("hal/dspic33/nvm_flash.c", "bool nvm_open(void)"),
        ("firmware/dspic33/main_dspic33.c", "int main(void)"),
    ],
)
def test_names_that_pass(tmp_path: Path, path: str, function: str) -> None:
    assert run_check(tmp_path, path, f"/* shift( */\nint x;\n{function}\n{{\n}}\n") == (0, [])


@pytest.mark.parametrize("function", ["void pdcp_queue_init(int a)", "int\nshift(void)", "bool hal(int a)"])
def test_name_of_another_file_is_found(tmp_path: Path, function: str) -> None:
    text = f"static int one(void)\n{{\n    return 1;\n}}\n\n{function}\n{{\n}}\n"
    status, output = run_check(tmp_path, "pdcp/common/pdcp_txq.c", text)
    line = 7 + function.count("\n")
    name = function.split("(")[0].split()[-1]
    assert (status, output) == (1, [f"pdcp/common/pdcp_txq.c:{line}: {name} does not begin with pdcp_txq"])


@pytest.mark.parametrize("name", ["on_stranger", "PDCP_EVENT_WISH", "feed", "slot_at"])
def test_retired_word_is_found(tmp_path: Path, name: str) -> None:
    status, output = run_check(tmp_path, "pdcp/common/pdcp_txq.h", f"/* {name} */\nextern int {name};\n")
    assert status == 1
    assert len(output) == 1
    assert output[0].startswith(f"pdcp/common/pdcp_txq.h:2: {name}: say ")


@pytest.mark.parametrize("name", ["feedback", "wishbone", "slots_of_time"])
def test_similar_word_passes(tmp_path: Path, name: str) -> None:
    assert run_check(tmp_path, "pdcp/common/pdcp_txq.h", f"extern int {name};\n") == (0, [])


def test_tree_without_sources_is_an_error(tmp_path: Path) -> None:
    result = subprocess.run([sys.executable, SCRIPT, tmp_path], capture_output=True, check=False)
    assert result.returncode == 2
