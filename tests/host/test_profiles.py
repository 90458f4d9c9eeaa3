"""The profile tree in its three forms, and its words."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdcp.profiles import describe_type, parse_profile, profile_name, profile_path, profiles

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "docs/spec/protocol.toml"
HEADER = ROOT / "profile/profile_tree.h"
DOCUMENT = ROOT / "docs/profiles.md"
COLUMNS = ("path", "name", "means", "scale", "mode", "sign", "rate", "safe")
ACCEPTANCE = (0x2110, 0x2120, 0x2200, 0x1100, 0x1110, 0x1210, 0x1220)  # profile-layer.md 6
WORDS = st.integers(0, 0xFFFF)


def components(word: int) -> list[int]:
    return [word >> shift & 0xF for shift in (12, 8, 4, 0)]


def rows() -> dict[int, dict[str, str]]:
    return {int(word, 16): row for word, row in tomllib.loads(TABLE.read_text())["profiles"].items()}


def test_document_says_what_the_table_says() -> None:
    table: dict[int, dict[str, str]] = {}
    for line in DOCUMENT.read_text().splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if cells and re.fullmatch("[0-9A-F]{4}", cells[0]):
            values = dict(zip(COLUMNS, [cells[1].strip("`"), *cells[2:]], strict=True))
            assert int(cells[0], 16) not in table
            table[int(cells[0], 16)] = {key: value for key, value in values.items() if value}
    assert table == rows()


def test_header_has_the_same_words() -> None:
    found = re.findall(r"^ +PROFILE_(\w+) = 0x([0-9A-F]{4}),? +/\* (.+) \*/$", HEADER.read_text(), re.MULTILINE)
    have = {int(word, 16): (name, comment) for name, word, comment in found}
    assert len(have) == len(found) == HEADER.read_text().count(" = 0x")
    assert have == {word: (row["path"].upper().replace(".", "_"), row["name"]) for word, row in rows().items()}


def test_header_is_c_and_clashes_with_no_other(tmp_path: Path) -> None:
    others = [path.name for path in (ROOT / "profile").glob("*.h")]
    source = tmp_path / "all.c"
    source.write_text("".join(f'#include "{name}"\n' for name in sorted(others)) + "int profile_tree_is_c;\n")
    flags = ["-std=c99", "-pedantic-errors", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
    folders = [ROOT / "profile", *sorted((ROOT / "pdcp").glob("*/"))]
    subprocess.run(["cc", *flags, *(f"-I{folder}" for folder in folders), source], check=True)


def test_every_node_is_well_formed() -> None:
    tree = profiles()
    assert list(tree) == sorted(tree)
    assert len({node.path for node in tree.values()}) == len({node.name for node in tree.values()}) == len(tree)
    for word, node in tree.items():
        parts = components(word)
        used = [part for part in parts if part]
        assert parts == used + [0] * (4 - len(used))  # zeros only at the end
        assert all(part % 2 == 0 for part in used[1:])  # odd ones are for vendors (D-PRO-22)
        assert len(used) == 1 or int("".join(f"{part:X}" for part in used[:-1]).ljust(4, "0"), 16) in tree
        assert all(getattr(node, key) for key in COLUMNS)


def test_children_have_the_path_of_their_parent() -> None:
    for word, node in profiles().items():
        used = [part for part in components(word) if part]
        assert len(node.path.split(".")) == max(1, len(used) - 1)
        if len(used) > 2:
            parent = int("".join(f"{part:X}" for part in used[:-1]).ljust(4, "0"), 16)
            assert node.path.rpartition(".")[0] == profiles()[parent].path


def test_roots_tell_set_points_from_sensor_signals() -> None:
    assert {word: node.path for word, node in profiles().items() if not word & 0x0FFF} == {
        0x1000: "set_point",
        0x2000: "sensor",
    }
    for word in ACCEPTANCE:
        root = "Set point" if word < 0x2000 else "Sensor signal"
        assert profiles()[word & 0xF000].name == root
        assert profile_name(word) is not None


@pytest.mark.parametrize(
    ("word", "name"),
    [
        (0x2220, "EMG amplitude"),
        (0x2221, "EMG amplitude > 2221h"),
        (0x2231, "EMG > 2231h"),
        (0x2120, "Sensor signal > 2120h"),
        (0x1220, "Power grip"),
        (0x1110, "Set point > 1110h"),
        (0x2020, "Sensor signal > 2020h"),
        (0x0000, None),
        (0x0220, None),
        (0x3220, None),
    ],
)
def test_name_of_a_word(word: int, name: str | None) -> None:
    assert profile_name(word) == name


@given(WORDS)
def test_a_name_is_that_of_the_nearest_ancestor(word: int) -> None:
    ancestors = [word & mask for mask in (0xFFFF, 0xFFF0, 0xFF00, 0xF000) if word & mask in profiles()]
    name = profile_name(word)
    if not ancestors:
        assert name is None
    elif ancestors[0] == word:
        assert name == profiles()[word].name and profile_path(word) == profiles()[word].path
    else:
        assert name == f"{profiles()[ancestors[0]].name} > {word:04X}h" and profile_path(word) is None


@pytest.mark.parametrize("text", ["2220", "2220h", "0x2220", "emg.amplitude", " EMG.Amplitude ", "2220H"])
def test_ways_to_write_a_profile(text: str) -> None:
    assert parse_profile(text) == 0x2220


def test_every_path_and_word_is_read_back() -> None:
    for word, node in profiles().items():
        assert parse_profile(node.path) == parse_profile(f"{word:04X}") == word


@pytest.mark.parametrize("text", ["", "emg.amplitud", "22200", "grip.", "-1", "0x12345", "222"])
def test_what_is_no_profile(text: str) -> None:
    with pytest.raises(ValueError, match="neither the path of a profile nor a hexadecimal number"):
        parse_profile(text)


def test_a_wrong_path_names_what_is_close() -> None:
    with pytest.raises(ValueError, match=r"perhaps emg\.amplitude"):
        parse_profile("emg.amplitud")


@pytest.mark.parametrize(
    ("word", "text"),
    [
        (0x5300, "8 bits, unsigned, position, sole access, terminal"),  # D-PRO-1
        (0x7200, "8 bits, boolean, position, sole access"),
        (0x7000, "8 bits, boolean, position"),
        (0x0000, "4 bits, signed, position"),
        (0x9400, "12 bits, unsigned, velocity"),
        (0xE800, "16 bits, float, acceleration"),
        (0x6000, "8 bits, float, position, not allowed: float needs 16 bits"),  # D-PRO-2
        (0x4C00, "8 bits, signed, other"),
        (0xC020, "16 bits, signed, position, x10^-6"),  # D-PRO-8
        (0xC0E0, "16 bits, signed, position, x10^6"),
        (0x501F, "8 bits, unsigned, position, unused bits 1Fh"),
    ],
)
def test_type_in_words(word: int, text: str) -> None:
    assert describe_type(word) == text


@given(WORDS)
def test_any_word_is_a_type(word: int) -> None:
    assert describe_type(word)
