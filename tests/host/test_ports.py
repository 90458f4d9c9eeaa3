"""pdcp ports: daemons found through /proc, here one laid out by hand."""

from pathlib import Path

import pytest

from pdcp.cli.ports import Daemon, daemons


class Proc:
    """A folder like /proc."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def add(self, pid: int, *words: str, terminal: int | None = None) -> None:
        process = self.folder / str(pid)
        (process / "fd").mkdir(parents=True)
        (process / "fdinfo").mkdir()
        (process / "cwd").symlink_to("/home/somebody")
        (process / "cmdline").write_bytes(b"".join(word.encode() + b"\0" for word in words))
        (process / "fd/0").symlink_to("/dev/null")
        (process / "fdinfo/0").write_text("pos:\t0\nflags:\t02\n", encoding="ascii")
        if terminal is not None:
            (process / "fd/7").symlink_to("/dev/ptmx")
            (process / "fdinfo/7").write_text(f"pos:\t0\nflags:\t02\ntty-index:\t{terminal}\n", encoding="ascii")


@pytest.fixture
def proc(tmp_path: Path) -> Proc:
    (tmp_path / "uptime").write_text("1 2", encoding="ascii")
    return Proc(tmp_path)


@pytest.mark.parametrize(
    ("words", "terminal", "daemon"),
    [
        (["pdcpd", "--can", "sim:1", "--host", "pty"], 3, Daemon(9, "/dev/pts/3", None, "sim:1")),
        (["/usr/bin/pdcpd", "-c", "sim", "-Hpty:/run/limb"], 12, Daemon(9, "/dev/pts/12", "/run/limb", "sim")),
        (["pdcpd", "--host=pty:limb", "--can=sim"], 0, Daemon(9, "/dev/pts/0", "/home/somebody/limb", "sim")),
        (["pdcpd", "--config", "a.ini"], 4, Daemon(9, "/dev/pts/4", None, None)),
        (["pdcpd", "--can", "sim", "--host", "serial:/dev/ttyS1@57600"], None, Daemon(9, "/dev/ttyS1", None, "sim")),
        (["pdcpd", "--can", "sim", "--host"], None, Daemon(9, None, None, "sim")),
    ],
)
def test_a_daemon(proc: Proc, words: list[str], terminal: int | None, daemon: Daemon) -> None:
    proc.add(9, *words, terminal=terminal)
    proc.add(10, "bash", "pdcpd", terminal=5)
    proc.add(11)
    assert list(daemons(proc.folder)) == [daemon]


def test_several_daemons(proc: Proc) -> None:
    """By their number; one that ends meanwhile is left out."""
    proc.add(100, "pdcpd", "--can", "sim", terminal=1)
    proc.add(20, "pdcpd", "--can", "sim", terminal=2)
    proc.add(30, "pdcpd", "--can", "sim", terminal=3)
    (proc.folder / "30/fdinfo/7").unlink()
    assert [daemon.pid for daemon in daemons(proc.folder)] == [20, 100]


def test_no_proc(tmp_path: Path) -> None:
    assert list(daemons(tmp_path / "proc")) == []
