"""The golden exchanges read by other people's tools, and `replay` on logs that are wrong."""

import io
import os
import re
import shutil
import subprocess
from pathlib import Path

import can
import pytest

FOLDER = Path(__file__).resolve().parent
LOGS = sorted(FOLDER.glob("*.log"))
REPLAY = os.environ.get("REPLAY", "")

# Base frames alone: what candump writes for other kinds is python-can's business, not ours.
FRAME = re.compile(r"^\((\d+\.\d{6})\) can0 ([0-9A-F]{3})#((?:[0-9A-F]{2}){0,8}) ([RT])$", re.MULTILINE)


def without_comments(log: Path) -> str:
    return "".join(line for line in log.read_text().splitlines(keepends=True) if not line.startswith("#"))


@pytest.mark.parametrize("log", LOGS, ids=lambda log: str(log.stem))
def test_python_can_reads_it(log: Path) -> None:
    text = without_comments(log)
    messages = [message for message in can.CanutilsLogReader(io.StringIO(text)) if not message.is_extended_id]
    messages = [message for message in messages if not message.is_remote_frame and not message.is_fd]
    frames = FRAME.findall(text)
    assert len(messages) == len(frames)
    for message, (time, can_id, data, direction) in zip(messages, frames, strict=True):
        assert message.timestamp == float(time)
        assert message.arbitration_id == int(can_id, 16)
        assert bytes(message.data) == bytes.fromhex(data)
        assert message.is_rx == (direction == "R")


# Without times: log2asc takes every frame of second 0 for the first one.
@pytest.mark.skipif(shutil.which("log2asc") is None, reason="can-utils are not installed")
@pytest.mark.parametrize("log", LOGS, ids=lambda log: str(log.stem))
def test_log2asc_reads_it(log: Path) -> None:
    result = subprocess.run(["log2asc", "-I", log, "can0"], capture_output=True, text=True, check=True)
    have = re.findall(r" 1 +([0-9A-F]{1,3}) +([RT])x +d (\d)((?: [0-9A-F]{2})*) *$", result.stdout, re.MULTILINE)
    want = [(can_id, way, str(len(data) // 2), data) for _, can_id, data, way in FRAME.findall(log.read_text())]
    assert [(can_id.zfill(3), way, dlc, data.replace(" ", "")) for can_id, way, dlc, data in have] == want


def replay(path: Path, text: str) -> tuple[int, str]:
    path.write_text(text)
    result = subprocess.run([REPLAY, path], capture_output=True, text=True, check=False)
    return result.returncode, result.stderr


GOOD = """\
#! in-service
(0.000000) can0 100#0A T
#! remember 1234:5678:9ABC 20
(0.010000) can0 620#0134127856BC9A R
(0.010000) can0 320#812034127856BC9A T
(0.010000) can0 320#030100 T
(0.011000) can0 220#83000100 R
#! until 0.100000
"""

WRONG = {
    "another byte leaves": ("812034127856BC9A T", "8120341278569ABC T"),
    "a frame does not leave": ("320#030100 T\n", "320#030100 T\n(0.010000) can0 320#030200 T\n"),
    "a frame leaves that is not there": ("(0.010000) can0 320#030100 T\n", ""),
    "it leaves later": ("(0.010000) can0 320#030100 T", "(0.009000) can0 320#030100 T"),
    "it leaves earlier": ("(0.010000) can0 320#030100 T", "(0.011000) can0 320#030100 T"),
    "in another order": ("(0.000000) can0 100#0A T\n", ""),
    "it leaves behind the last line": ("0.100000", "0.261000"),
    "no time": ("(0.011000)", "0.011000"),
    "no whole millisecond": ("(0.011000)", "(0.011500)"),
    "no frame": ("220#83000100", "220-83000100"),
    "half a byte": ("220#83000100", "220#8300010"),
    "no direction": ("220#83000100 R", "220#83000100"),
    "an unknown direction": ("220#83000100 R", "220#83000100 X"),
    "an unknown action": ("#! until", "#! till"),
    "too few words": ("#! until 0.100000", "#! until"),
    "nothing is done": ("#! until", "#! done ok\n#! until"),
    "a device that is not there": ("#! until", "#! get 21 00 08\n#! until"),
    "an outcome that nobody asked for": ("#! until 0.100000", "#! reset 20\n(0.050000) can0 320#0B T\n"
                                         "(0.051000) can0 220#8B01 R"),
    "nothing follows an action": ("#! until 0.100000", "#! get 20 00 08"),
    "an include that is not there": ("#! until", "#! include missing.log\n#! until"),
}  # fmt: skip


@pytest.mark.skipif(not REPLAY, reason="REPLAY does not name the program")
def test_replay_accepts_a_good_log(tmp_path: Path) -> None:
    assert replay(tmp_path / "good.log", GOOD) == (0, "")


@pytest.mark.skipif(not REPLAY, reason="REPLAY does not name the program")
@pytest.mark.parametrize("name", WRONG)
def test_replay_refuses_a_wrong_log(tmp_path: Path, name: str) -> None:
    old, new = WRONG[name]
    assert old in GOOD
    status, error = replay(tmp_path / "wrong.log", GOOD.replace(old, new, 1))
    assert status == 1
    assert re.search(r"\.log:\d+: at \d+ ms: ", error)
