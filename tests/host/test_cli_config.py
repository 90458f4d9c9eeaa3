"""The commands of pdcp config: files, and an arbitrator that is a stand-in for the client."""

import sys
from collections.abc import Callable
from io import BytesIO, TextIOWrapper
from pathlib import Path
from types import SimpleNamespace

import pytest

from pdcp.cli import app, config
from pdcp.cli.common import run

STRING = bytes((1, 1, 0, 2, 1, 0, 3, 1, 0, 4, 1, 0, 5, 0, 0, 8, 0x20, 0x12, 99, 1, 2, 15, 0, 0))
YAML = """\
configurations:
- configuration: 1
  links:
  - link: 1
    input:
      profile: 0x1220  # Power grip
      code_99: 0x0201
"""

Pdcp = Callable[..., tuple[int, str, str]]


class Client:
    def __init__(self, data: bytes) -> None:
        self.data = data

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def info(self) -> SimpleNamespace:
        return SimpleNamespace(stored=0)

    def read_configurations(self, progress: Callable[[int, int], None]) -> bytes:
        progress(len(self.data), len(self.data))
        return self.data

    def write_configurations(self, data: bytes, progress: Callable[[int, int], None]) -> None:
        progress(len(data), len(data))
        self.data = data


@pytest.fixture
def client(monkeypatch: pytest.MonkeyPatch) -> Client:
    found = Client(STRING)
    monkeypatch.setattr(config, "connect", lambda _: found)
    return found


@pytest.fixture
def pdcp(capfdbinary: pytest.CaptureFixture[bytes]) -> Pdcp:
    """pdcp(ARGUMENT...): exit status, standard output, standard error."""

    def call(*arguments: object) -> tuple[int, str, str]:
        status = run(app, [str(argument) for argument in arguments])
        out, errors = capfdbinary.readouterr()
        return status, out.decode("latin-1"), errors.decode()

    return call


def test_export(pdcp: Pdcp, client: Client, tmp_path: Path) -> None:
    assert pdcp("config", "export") == (0, YAML, "")
    assert pdcp("config", "export", tmp_path / "a.yaml") == (0, "", "")
    assert (tmp_path / "a.yaml").read_text() == YAML


def test_import_gives_the_same_bytes_back(pdcp: Pdcp, client: Client, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(YAML)
    client.data = b""
    assert pdcp("config", "import", path) == (0, "1 configuration stored, 24 bytes\n", "")
    assert client.data == STRING


def test_import_from_standard_input(pdcp: Pdcp, client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", TextIOWrapper(BytesIO(b"configurations: []\n")))
    assert pdcp("config", "import", "-") == (0, "0 configurations stored, 6 bytes\n", "")
    assert client.data == bytes((1, 0, 0, 15, 0, 0))


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (b"configurations: 7\n", "line 1: configurations must be a list"),
        (b"entries:\n- end: 1\n- link: 2\n- x: 3\n", "line 4: x is not known here"),
        (b"entries:\n- number_of_configurations: 3\n- end: 0\n", "3 configurations are announced, 0 are there"),
        (b"entries: []\n", "no end (code 15) in 0 bytes"),
        (b"\xff\n", "byte 0: no UTF-8"),
    ],
)
def test_nothing_is_written_from_a_wrong_file(
    pdcp: Pdcp, client: Client, tmp_path: Path, text: bytes, error: str
) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(text)
    for words in (["import", path], ["encode", path, tmp_path / "out"]):
        status, out, errors = pdcp("config", *words)
        assert (status, out, errors.count("\n")) == (2, "", 1)
        assert errors.startswith(f"pdcp: {path}: {error}")
    assert client.data == STRING and not (tmp_path / "out").exists()


def test_decode_and_encode_without_an_arbitrator(pdcp: Pdcp, tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(STRING)
    assert pdcp("config", "decode", tmp_path / "a.bin", tmp_path / "a.yaml") == (0, "", "")
    assert (tmp_path / "a.yaml").read_text() == YAML
    assert pdcp("config", "encode", tmp_path / "a.yaml") == (0, STRING.decode("latin-1"), "")


def test_a_damaged_string_shows_its_entries_if_told(pdcp: Pdcp, tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(STRING[:-2])
    status, out, errors = pdcp("config", "decode", path)
    assert (status, out) == (2, "")
    assert errors == f"pdcp: {path}: no end (code 15) in 22 bytes; --entries shows what is there\n"
    status, out, _ = pdcp("config", "decode", path, "--entries")
    assert status == 0 and out.endswith('- code_99: 0x0201\nrest: "0F"\n')


@pytest.mark.parametrize("words", [["decode", "gone.bin"], ["encode", "gone.yaml"], ["import", "gone.yaml"]])
def test_missing_files_are_exit_2(pdcp: Pdcp, client: Client, words: list[str]) -> None:
    assert pdcp("config", *words) == (2, "", f"pdcp: {words[1]}: No such file or directory\n")


def test_a_place_that_cannot_be_written_is_exit_2(pdcp: Pdcp, client: Client) -> None:
    status, _, errors = pdcp("config", "export", "/nowhere/a.yaml")
    assert (status, errors) == (2, "pdcp: /nowhere/a.yaml: No such file or directory\n")
