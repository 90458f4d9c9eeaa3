"""tools/check_layers.py on small trees: what it must find, with file and line, and what it must leave alone."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "check_layers.py"

CLEAN_TREE = {
    "pdcp/common/can_frame.h": "#include <stdint.h>\ntypedef struct { uint16_t id; } can_frame_t;\n",
    "pdcp/common/pdcp_codec.h": '#include "can_frame.h"\n',
    "pdcp/common/pdcp_codec.c": '#include "pdcp_codec.h"\n/* malloc( */\nconst char *s = "printf(";\n// free(\n',
    "profile/profile_type.c": '#include "pdcp_codec.h"\n',
    "firmware/arb_app.c": '#include "pdcp_codec.h"\n#include <string.h>\n',
    "firmware/dspic33/main_dspic33.c": '#include <xc.h>\n#include "hal_can.h"\nint main(void)\n{\n    return 0;\n}\n',
    "firmware/dspic33/node_dspic33.c": '#include <xc.h>\n#include "hal_can.h"\nint main(void)\n{\n    return 0;\n}\n',
    "firmware/arb_port.h": '#include "can_frame.h"\n',
    "firmware/store/arb_nvm.c": '#include "arb_port.h"\n',
    "firmware/host/arb_hostapi.h": '#include "arb_port.h"\n',
    "pdcp/arbitrator/pdcp_arb.h": '#include "pdcp_codec.h"\n',
    "pdcp/device/pdcp_device.h": '#include "pdcp_codec.h"\n',
    "hal/include/hal_can.h": '#include "can_frame.h"\n',
    "hal/dspic33/part.h": "#include <xc.h>\n",
    "tests/fakes/xc.h": "",
    "hal/linux/loop.h": "#include <time.h>\n",
    "hal/linux/loop.c": '#include "loop.h"\n#include "hal_can.h"\n#include <stdio.h>\n',
    "host_sim/sim_bus.c": '#include "loop.h"\n#include "pdcp_codec.h"\n',
    "tests/unit/test_loop.c": '#include "loop.h"\n#include "unity.h"\n',
}


def write_tree(root: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def run_check(root: Path, files: dict[str, str]) -> tuple[int, list[str]]:
    """Exit status and output lines for the clean tree with these files added or replaced."""
    write_tree(root, CLEAN_TREE | files)
    result = subprocess.run([sys.executable, SCRIPT, root], capture_output=True, text=True, check=False)
    return result.returncode, result.stdout.splitlines()


def function_of(lines: int) -> str:
    """A function whose braces stand this many lines apart, both counted."""
    return "int long_one(int a)\n{\n" + "    a++;\n" * (lines - 2) + "}\n"


def test_clean_tree_passes(tmp_path: Path) -> None:
    assert run_check(tmp_path, {}) == (0, [])


def test_tree_without_sources_is_an_error(tmp_path: Path) -> None:
    result = subprocess.run([sys.executable, SCRIPT, tmp_path], capture_output=True, check=False)
    assert result.returncode == 2


@pytest.mark.parametrize(
    ("path", "include"),
    [
        ("pdcp/common/bad.c", '"pdcp_arb.h"'),
        ("pdcp/arbitrator/bad.c", '"pdcp_device.h"'),
        ("pdcp/device/bad.c", '"pdcp_arb.h"'),
        ("profile/bad.c", '"pdcp_device.h"'),
        ("profile/bad.c", '"arb_port.h"'),
        ("firmware/arb_bad.c", '"pdcp_device.h"'),
        ("firmware/store/arb_bad.c", '"arb_hostapi.h"'),
        ("pdcp/bad.c", '"hal_can.h"'),
        ("pdcp/bad.c", '"../hal/include/hal_can.h"'),
        ("pdcp/bad.c", "<hal_can.h>"),
        ("pdcp/bad.c", "<stdio.h>"),
        ("pdcp/bad.c", "<time.h>"),
        ("pdcp/bad.c", "<unistd.h>"),
        ("profile/bad.h", '"hal_can.h"'),
        ("firmware/arb_bad.c", '"loop.h"'),
        ("hal/include/hal_bad.h", '"pdcp_codec.h"'),
        ("hal/include/hal_bad.h", '"loop.h"'),
        ("hal/dspic33/bad.c", '"loop.h"'),
        ("firmware/dspic33/main_dspic33.c", '"sim_bus.h"'),
        ("firmware/arb_bad.c", "<xc.h>"),
    ],
)
def test_forbidden_include_is_found(tmp_path: Path, path: str, include: str) -> None:
    status, output = run_check(tmp_path, {path: f"/* two\nlines */\n#include {include}\n", "host_sim/sim_bus.h": ""})
    assert status == 1
    assert len(output) == 1
    assert output[0].startswith(f"{path}:3: ")


@pytest.mark.parametrize("name", ["malloc", "free", "snprintf", "sleep", "time", "clock"])
@pytest.mark.parametrize("folder", ["pdcp", "profile", "firmware"])
def test_banned_name_is_found(tmp_path: Path, folder: str, name: str) -> None:
    status, output = run_check(tmp_path, {f"{folder}/bad.c": f'const char *s = "\\"";\n\nvoid *p = {name} (4);\n'})
    assert status == 1
    assert output == [f"{folder}/bad.c:3: {name} is banned in {folder}/, it is portable"]


@pytest.mark.parametrize(
    "text", ["int time_ms;\n", "int sleepy;\n", "char c = '\"'; /* malloc */\n", "#include <math.h>\n"]
)
def test_similar_names_pass(tmp_path: Path, text: str) -> None:
    assert run_check(tmp_path, {"pdcp/good.c": text}) == (0, [])


@pytest.mark.parametrize("folder", ["pdcp", "hal/linux", "host_sim"])
def test_function_length(tmp_path: Path, folder: str) -> None:
    assert run_check(tmp_path, {f"{folder}/long.c": function_of(60)}) == (0, [])
    status, output = run_check(tmp_path, {f"{folder}/long.c": "int x;\n" + function_of(61)})
    assert status == 1
    assert output == [f"{folder}/long.c:3: function long_one has 61 lines, more than 60"]


@pytest.mark.parametrize(("folder", "limit"), [("pdcp/common", 500), ("firmware/host", 500), ("hal/linux", 600)])
def test_file_length(tmp_path: Path, folder: str, limit: int) -> None:
    assert run_check(tmp_path, {f"{folder}/long.c": "int x;\n" * limit}) == (0, [])
    status, output = run_check(tmp_path, {f"{folder}/long.c": "int x;\n" * (limit + 1)})
    assert status == 1
    assert output == [f"{folder}/long.c:{limit + 1}: the file has {limit + 1} lines, more than {limit}"]


def test_circle_of_files_is_found(tmp_path: Path) -> None:
    files = {
        "profile/a.h": '#include "b.h"\n',
        "profile/b.c": '#include "b.h"\n\n#include "c.h"\n',
        "profile/b.h": "",
        "profile/c.h": '#include "a.h"\n',
        "profile/d.c": '#include "a.h"\n',
    }
    status, output = run_check(tmp_path, files)
    assert status == 1
    assert output == [
        "profile/a.h:1: b.h includes a.h in turn: a circle",
        "profile/b.c:3: c.h includes b.h in turn: a circle",
        "profile/c.h:1: a.h includes c.h in turn: a circle",
    ]


def test_long_table_is_no_function(tmp_path: Path) -> None:
    table = "const int t[] = {\n" + "    1,\n" * 80 + "};\nint f(void)\n{\n    return t[0];\n}\n"
    assert run_check(tmp_path, {"pdcp/table.c": table}) == (0, [])
