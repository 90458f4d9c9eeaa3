"""Devices as processes of their own on the simulated bus: links, values, loss and return."""

import os
import signal
import struct
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from queue import Empty

import pytest
from programs import LINE_TIMEOUT_S, Pdcpd, Program, Value, until
from simbus import open_sim_bus

from pdcp import ChannelId, Client, Identity, LinkStatus, RequestError

IDENTITIES = {"d1": Identity(2, 2, 4), "d2": Identity(2, 2, 5), "d3": Identity(2, 2, 6)}
D1, D2, D3 = IDENTITIES.values()
LINKS = {
    (ChannelId(D1, 1), ChannelId(D2, 2)),
    (ChannelId(D2, 3), ChannelId(D3, 1)),
    (ChannelId(D2, 5), ChannelId(D3, 2)),
}
BEACON_MS = 200
IDS_KEPT_S = 10.0
STOPPED_S = 1.5  # more than three beacons, less than the 3 s after which a device counts itself alone
NODE_ID = 8  # parameter of a device
OUTPUT_ID = 5  # parameter of an output

Start = Callable[..., Pdcpd]
StartNode = Callable[..., Program]


class Candump(threading.Thread):
    """Keeps every frame on the bus; what is not channel data is printed when a test fails."""

    def __init__(self, port: int) -> None:
        super().__init__(daemon=True)
        self.frames: list[tuple[float, int, bytes]] = []
        self._ends = False
        self._bus = open_sim_bus(port)
        self.start()

    def run(self) -> None:
        while not self._ends:
            message = self._bus.recv(0.05)
            if message is not None:
                self.frames.append((message.timestamp, message.arbitration_id, bytes(message.data)))

    def data_of(self, output_id: int) -> list[int]:
        """The one byte of each frame with channel data from an output."""
        return [data[0] for _, identifier, data in self.frames if identifier == output_id]

    def close(self) -> None:
        self._ends = True
        self.join()
        self._bus.shutdown()
        for time_s, identifier, data in self.frames:
            if identifier >= 0x100 or data == b"\x0a":
                print(f"({time_s:.6f}) can0 {identifier:03X}#{data.hex().upper()}")


class Limb:
    """pdcpd, three processes with one device each, a host, and a log of the bus."""

    def __init__(
        self, pdcpd: Pdcpd, files: dict[str, Path], start_node: StartNode, host: Client, log: Candump
    ) -> None:
        self.pdcpd = pdcpd
        self.host = host
        self.log = log
        self._files = files
        self._start_node = start_node
        self.nodes: dict[str, Program] = {}
        for name, path in files.items():
            text = path.read_text(encoding="utf-8").replace("[device]\n", f"[device]\nbeacon_ms = {BEACON_MS}\n")
            path.write_text(text, encoding="utf-8")
            self.start(name)

    def start(self, name: str) -> None:
        self.nodes[name] = self._start_node(self.pdcpd, self._files[name])

    def forget_asked_id(self, name: str) -> None:
        """From its next start on the device asks for a random id."""
        lines = self._files[name].read_text(encoding="utf-8").splitlines(keepends=True)
        self._files[name].write_text("".join(line for line in lines if "node_id" not in line), encoding="utf-8")

    def is_whole(self) -> bool:
        return self.host.system_info()[:3] == (3, 4, 4)

    def make_links(self) -> None:
        until(self.is_whole, "three devices with four inputs and four outputs")
        for output, input_ in LINKS:
            assert self.host.link(output, input_) == LinkStatus.ACTIVE

    def links(self) -> dict[tuple[ChannelId, ChannelId], int]:
        return {(link.output, link.input): link.status for link in self.host.links()}

    def is_linked(self) -> bool:
        return self.links() == dict.fromkeys(LINKS, LinkStatus.ACTIVE)

    def names(self) -> set[Identity]:
        return {device.identity for device in self.host.devices()}

    def arriving(self, count: int) -> list[Value]:
        """The next values at D3, without safe ones, until both inputs have had so many."""
        queue = self.nodes["d3"].values
        while not queue.empty():
            queue.get()
        values: list[Value] = []
        counts = {1: 0, 2: 0}
        deadline = time.monotonic() + LINE_TIMEOUT_S
        while min(counts.values()) < count:
            try:
                value = queue.get(timeout=max(0.0, deadline - time.monotonic()))
            except Empty:
                pytest.fail(f"of {count} values only {counts} arrived at the two inputs of D3")
            if not value.safe:
                values.append(value)
                counts[value.channel] += 1
        return values


@pytest.fixture
def limb(
    start: Start,
    start_node: StartNode,
    connect: Callable[[Pdcpd], Client],
    files: dict[str, Path],
    stack: ExitStack,
) -> Limb:
    pdcpd = start("--can", "sim:0")
    log = Candump(pdcpd.bus_port())
    stack.callback(log.close)
    return Limb(pdcpd, files, start_node, connect(pdcpd), log)


def is_part(values: list[int], of: list[int]) -> bool:
    """Are these values in the list, in their order? On a busy machine the controller drops some."""
    rest = iter(of)
    return all(value in rest for value in values)


def test_values_arrive(limb: Limb) -> None:
    """The three devices, each a process, bound with the ids they ask for, linked, and the sine goes all the way."""
    limb.make_links()
    assert [limb.host.get_parameter(ChannelId(each), NODE_ID) for each in (D1, D2, D3)] == [b"\x10", b"\x20", b"\x30"]
    assert limb.is_linked()
    sensor_id = limb.host.get_parameter(ChannelId(D1, 1), OUTPUT_ID)[0]
    values = limb.arriving(60)  # 1.2 s of 2: more than a half turn
    wrist = [value.value for value in values if value.channel == 1 and value.value is not None]
    assert {value.device for value in values} == {D3}
    assert min(wrist) >= 0 and max(wrist) <= 255 and max(wrist) - min(wrist) > 100
    until(lambda: is_part(wrist, limb.log.data_of(sensor_id)), f"the sensor has sent {wrist}")
    grip = {value.value for value in values if value.channel == 2}
    assert grip == {0, 1}


def test_a_stopped_daemon_declares_nobody_lost(limb: Limb) -> None:
    """Stopped for longer than three beacons (Ctrl-Z, a debugger), it hears what came meanwhile before it judges."""
    limb.make_links()
    limb.arriving(3)
    os.kill(limb.pdcpd.process.pid, signal.SIGSTOP)
    time.sleep(STOPPED_S)
    os.kill(limb.pdcpd.process.pid, signal.SIGCONT)
    limb.arriving(60)
    assert limb.is_linked()
    assert not [line for line in limb.pdcpd.errors if "is gone" in line]
    assert limb.host.stats(0)["lost"] == 0


@pytest.mark.parametrize("name", ["d1", "d2", "d3"])
def test_a_device_is_lost_and_comes_back(limb: Limb, name: str) -> None:
    """D-BUS-6, D-BUS-14: its links are inactive while it is away; it gets its old id and its links back."""
    limb.make_links()
    limb.arriving(3)
    lost = IDENTITIES[name]
    old_id = limb.host.get_parameter(ChannelId(lost), NODE_ID)
    limb.nodes[name].kill()
    until(lambda: limb.names() == set(IDENTITIES.values()) - {lost}, "only the other two devices are there")
    hit = {link for link in LINKS if lost in (link[0].identity, link[1].identity)}
    expected = {link: LinkStatus.INACTIVE if link in hit else LinkStatus.ACTIVE for link in LINKS}
    until(lambda: limb.links() == expected, f"links are {expected}")
    with pytest.raises(RequestError) as error:
        limb.host.get_parameter(ChannelId(lost), NODE_ID)
    assert error.value.code == 0x03
    limb.forget_asked_id(name)
    limb.start(name)
    until(limb.is_linked, "all links are active again")
    assert limb.host.get_parameter(ChannelId(lost), NODE_ID) == old_id
    limb.arriving(3)


@pytest.mark.parametrize("name", ["d1", "d2", "d3"])
def test_a_device_restarts_before_it_is_missed(limb: Limb, name: str) -> None:
    """D-BUS-6: the identity of a bound device asks again, silence at its id says that it was reset: set up afresh."""
    limb.make_links()
    limb.arriving(3)
    old_id = limb.host.get_parameter(ChannelId(IDENTITIES[name], 0), NODE_ID)
    limb.nodes[name].kill()
    limb.forget_asked_id(name)
    limb.start(name)
    until(lambda: limb.is_whole() and limb.is_linked(), "all links are active again")
    limb.arriving(3)
    assert limb.host.get_parameter(ChannelId(IDENTITIES[name], 0), NODE_ID) == old_id


def test_a_sensor_is_away_for_longer_than_its_ids_are_kept(limb: Limb) -> None:
    """D-BUS-6, D-BUS-14: after the 10 s the identity still gets its old id, and the input still knows its source."""
    limb.make_links()
    old_id = limb.host.get_parameter(ChannelId(D1), NODE_ID)
    limb.nodes["d1"].kill()
    until(lambda: limb.names() == {D2, D3}, "the sensor is gone")
    time.sleep(IDS_KEPT_S + 0.5)
    assert limb.links()[(ChannelId(D1, 1), ChannelId(D2, 2))] == LinkStatus.INACTIVE
    limb.forget_asked_id("d1")
    limb.start("d1")
    until(limb.is_linked, "all links are active again")
    assert limb.host.get_parameter(ChannelId(D1), NODE_ID) == old_id
    limb.arriving(3)


def test_hand_goes_to_its_safe_value(limb: Limb) -> None:
    """pdcp-bus.md 9, D-BUS-14: the inputs that a lost output fed are disabled, which makes a terminal input safe."""
    limb.make_links()
    limb.arriving(3)
    limb.nodes["d2"].kill()
    safe: set[int] = set()

    def is_safe() -> bool:
        while not limb.nodes["d3"].values.empty():
            value = limb.nodes["d3"].values.get()
            if value.safe:
                assert value.value == 0
                safe.add(value.channel)
        return safe == {1, 2}

    until(is_safe, "both inputs of the hand are safe")


def test_identities_keep_their_ids(
    start: Start, connect: Callable[[Pdcpd], Client], files: dict[str, Path], tmp_path: Path
) -> None:
    """D-BUS-6: the table of identities outlives a restart; the devices ask for random ids each time."""
    nvm = tmp_path / "nvm"
    for path in files.values():
        text = path.read_text(encoding="utf-8")
        path.write_text("".join(line for line in text.splitlines(True) if "node_id" not in line), encoding="utf-8")
    found = []

    def is_stored(ids: list[bytes]) -> bool:
        memory = nvm.read_bytes()
        identities = (struct.pack("<HHH", device.vid, device.pid, device.sn) for device in (D1, D2, D3))
        return all(identity + node_id in memory for identity, node_id in zip(identities, ids, strict=True))

    for _ in range(3):
        pdcpd = start("--nvm", nvm, *(word for path in files.values() for word in ("--node", path)))
        host = connect(pdcpd)
        until(lambda host=host: host.system_info()[:3] == (3, 4, 4), "three devices are set up")  # type: ignore[misc]
        found.append([host.get_parameter(ChannelId(each), NODE_ID) for each in (D1, D2, D3)])
        until(lambda: is_stored(found[-1]), "the table is stored")
        assert pdcpd.stop() == 0
    assert found == [found[0]] * 3
