"""A device made of hand-made frames joins the simulated bus through python-can's socketcand client.

Frames are laid out by hand from pdcp-bus.md 1 and 2 ([PDCP 2.2, 3.2]). An identifier is priority (bits 10-9), mode (bit
8, 1 from the arbitrator) and node id: 600h binding, 000h beacon and 200h answer of a device, 300h what it is told.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import pairwise

import can
import pytest
from programs import LINE_TIMEOUT_S, Pdcpd, until
from rawhost import RawHost
from simbus import open_sim_bus

from pdcp import Channel, ChannelId, Device, Direction, ErrorCode, EventKind, Identity, RequestError
from pdcp.events import CanFrame, DeviceLost
from pdcp.wire import encode

BEACON_MS = 300  # as the device tells; it beacons more often, so that it is not lost when the machine is busy
BEACON_EACH_S = 0.05
BEACON_OF_ARBITRATOR = 0x100
DEAD = 0xFF  # an id that nobody is spoken to by (D-BUS-2)

Start = Callable[..., Pdcpd]
Connect = Callable[[Pdcpd], RawHost]
Frame = tuple[int, bytes]  # identifier, data


def frame(identifier: int, text: str) -> Frame:
    return identifier, bytes.fromhex(text)


class HandMade(threading.Thread):
    """Listens to the bus and plays one device on it.

    parameters: (parameter, channel) to value; what is not there is refused. Beacons are sent while beacons is True.
    log: all frames but its own; times_s: when each was on the bus, by the clock of pdcpd.
    After so many packets of a bulk transfer as packets_left says it is dead: unplugged, without power.
    """

    def __init__(self, port: int, node_id: int) -> None:
        super().__init__(daemon=True)
        self.node_id = node_id
        self.parameters: dict[tuple[int, int], bytes] = {}
        self.deaf_to: set[tuple[int, int]] = set()
        self.bulk: dict[tuple[int, int], bytes] = {}
        self.beacons = False
        self.packets_left = 1000
        self.log: list[Frame] = []
        self.times_s: list[float] = []
        self._packets: list[bytes] = []
        self._ends = False
        self._bus = open_sim_bus(port)
        self.start()

    def close(self) -> None:
        self._ends = True
        self.join()
        self._bus.shutdown()

    def send(self, identifier: int, text: str) -> None:
        self._put(identifier, bytes.fromhex(text))

    def _put(self, identifier: int, data: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def run(self) -> None:
        beaconed_s = 0.0
        while not self._ends:
            message = self._bus.recv(0.005)
            if message is not None:
                self.times_s.append(message.timestamp)
                self._take(message.arbitration_id, bytes(message.data))
            if self.beacons and time.monotonic() - beaconed_s >= BEACON_EACH_S:
                beaconed_s = time.monotonic()
                self._put(0x000 | self.node_id, b"\x0a")

    def _take(self, identifier: int, data: bytes) -> None:
        self.log.append((identifier, data))
        if identifier & 0x1FF == 0x100 | self.node_id and data:
            answer = self._answer(data)
            if answer:
                self._put(0x200 | self.node_id, answer)

    def _answer(self, data: bytes) -> bytes:
        code, rest = data[0], data[1:]
        if code == 0x8E and len(rest) == 1:  # the arbitrator has taken a packet
            return self._packet()
        place = (rest[0], rest[1]) if len(rest) >= 2 else (0, 0)
        if place in self.deaf_to:
            return b""
        if code == 0x03:
            if place in self.bulk:
                return b"\x83\x02" + rest
            known = place in self.parameters
            return b"\x83" + bytes([known]) + rest + self.parameters.get(place, b"")
        if code == 0x04:
            return b"\x84\x01" + rest
        if code == 0x0C and place in self.bulk:
            value = self.bulk[place]
            pieces = [value[at : at + 6] for at in range(0, len(value), 6)]
            self._packets = [b"\x0e" + bytes([number]) + piece for number, piece in enumerate(pieces)]
            self._put(0x200 | self.node_id, b"\x8c\x01" + rest + len(value).to_bytes(2, "little"))
            return self._packet()
        return b""

    def _packet(self) -> bytes:
        """The next packet of a bulk transfer."""
        if not self._packets:
            return b""
        self.packets_left -= 1
        if self.packets_left < 0:
            self.die()
            return b""
        return self._packets.pop(0)

    def die(self) -> None:
        """From now on it is silent."""
        self.beacons = False
        self.node_id = DEAD

    def received(self, identifier: int, code: int) -> list[bytes]:
        """Data of the frames with this identifier that begin with this function code."""
        return [data for each, data in self.log if each == identifier and data[:1] == bytes([code])]


@pytest.fixture
def pdcpd(start: Start) -> Pdcpd:
    return start("--can", "sim:0")


@pytest.fixture
def join(pdcpd: Pdcpd, stack: ExitStack) -> Callable[[int], HandMade]:
    """join(NODE_ID): a hand-made device on the bus; it says nothing yet."""

    def join_bus(node_id: int) -> HandMade:
        device = HandMade(pdcpd.bus_port(), node_id)
        stack.callback(device.close)
        return device

    return join_bus


@pytest.fixture
def sensor(join: Callable[[int], HandMade]) -> Iterator[HandMade]:
    """VID 1234h, PID 5678h, SN 9ABCh with one output, asking for id 45h."""
    device = join(0x45)
    device.parameters = {
        (1, 0): bytes.fromhex("34 12 78 56"),
        (2, 0): bytes.fromhex("BC 9A"),
        (6, 0): bytes.fromhex("11 22 33 44"),
        (9, 0): bytes.fromhex("01"),
        (10, 0): BEACON_MS.to_bytes(2, "little"),
        (11, 0): bytes.fromhex("F4 01"),  # the longest time for an answer (D-BUS-13): this machine may be busy
        (1, 1): bytes.fromhex("00 50 20 21"),
        (3, 1): bytes.fromhex("02"),
    }
    yield device


SENSOR = Identity(0x1234, 0x5678, 0x9ABC)
SENSOR_ASKS = "01 34 12 78 56 BC 9A"


def bind(sensor: HandMade, host: RawHost) -> None:
    sensor.send(0x645, SENSOR_ASKS)
    until(lambda: bool(sensor.received(0x345, 0x81)), "an answer to the bind request")
    sensor.beacons = True
    until(lambda: host.system_info() == (1, 0, 1, 0), "one device with one output")


def test_bind_and_setup(pdcpd: Pdcpd, connect: Connect, sensor: HandMade) -> None:
    """[PDCP 3.2.1], D-BUS-6, D-API-6: bound by one request, counted from its first beacon, set up, listed."""
    host = connect(pdcpd)
    sensor.send(0x645, SENSOR_ASKS)
    until(lambda: (0x304 | 0x41, bytes.fromhex("03 09 00")) in sensor.log, "the number of channels is asked for")
    assert sensor.received(0x345, 0x81) == [bytes.fromhex("81 45 34 12 78 56 BC 9A")]
    assert host.system_info().devices == 0
    sensor.beacons = True
    until(lambda: host.system_info() == (1, 0, 1, 0), "one device with one output")
    assert host.device(1) == Device(1, SENSOR, 0x2211, 0x4433)
    assert host.output(1) == Channel(1, Direction.OUTPUT, ChannelId(SENSOR, 1), 0x5000, 0x2120)
    told = [data for identifier, data in sensor.log if identifier == 0x345 and data[0] in (3, 4)]
    gets = [tuple(data[1:]) for data in told if data[0] == 3]
    assert set(gets[:6]) == {(1, 0), (2, 0), (6, 0), (9, 0), (10, 0), (11, 0)}
    silence = told.index(bytes.fromhex("04 04 01 00"))
    assert all(data[2] == 0 for data in told[:silence]), "a channel was touched before it was silenced"
    sets = [data for data in told if data[0] == 4]
    assert [data[:3] for data in sets] == [bytes.fromhex("04 04 01"), bytes.fromhex("04 05 01")]
    assert sets[-1][3] not in (0, 255, 0x45), "the node id of the output"


def test_what_a_host_gets_from_it(pdcpd: Pdcpd, connect: Connect, sensor: HandMade) -> None:
    """Bulk transfer both announced and carried out, a value, a refusal, and silence after three tries."""
    host = connect(pdcpd)
    bind(sensor, host)
    device = ChannelId(SENSOR)
    sensor.bulk[(7, 0)] = b"Hand-made sensor"
    assert host.get_parameter(device, 7) == b"Hand-made sensor"
    assert (0x345, bytes.fromhex("0C 07 00")) in sensor.log
    until(lambda: sensor.received(0x345, 0x8E) == [b"\x8e\x01"] * 3, "three packets are acknowledged")
    assert host.get_parameter(device, 6) == bytes.fromhex("11 22 33 44")
    with pytest.raises(RequestError) as refused:
        host.get_parameter(device, 0x63)
    assert refused.value.code == 0x06
    sensor.deaf_to.add((0x55, 0))
    with pytest.raises(RequestError) as silent:
        host.get_parameter(device, 0x55)
    assert silent.value.code == 0x05
    assert sensor.log.count((0x345, bytes.fromhex("03 55 00"))) == 3


@pytest.mark.parametrize("packets", [0, 1, 5])
def test_a_device_dies_in_the_middle_of_a_bulk_read(
    packets: int, pdcpd: Pdcpd, connect: Connect, sensor: HandMade
) -> None:
    """D-API-3: one answer all the same, error 05h or 0Ah; and the arbitrator goes on."""
    host = connect(pdcpd)
    bind(sensor, host)
    sensor.bulk[(7, 0)] = bytes(200)
    assert host.get_parameter(ChannelId(SENSOR), 7) == bytes(200)
    sensor.packets_left = packets
    with pytest.raises(RequestError) as error:
        host.get_parameter(ChannelId(SENSOR), 7)
    assert error.value.code in (ErrorCode.DEVICE_SILENT, ErrorCode.BULK_FAILED)
    assert sensor.packets_left == -1, "it did not die in the middle"
    until(lambda: host.system_info() == (0, 0, 0, 0), "the device is gone")
    with pytest.raises(RequestError) as unknown:
        host.get_parameter(ChannelId(SENSOR), 7)
    assert unknown.value.code is ErrorCode.UNKNOWN_DEVICE


def test_a_fifth_request_is_busy_at_once(pdcpd: Pdcpd, connect: Connect, sensor: HandMade) -> None:
    """D-API-3: four are held, the answer to the fifth is the only one out of order."""
    host = connect(pdcpd)
    bind(sensor, host)
    sensor.deaf_to.add((0x55, 0))
    get = bytes.fromhex("34 12 78 56 BC 9A 00 55")
    host.send_bytes(encode(0x2301, 1, get) + b"".join(encode(0x2201, reference) for reference in (2, 3, 4, 5)))
    answers = [host.receive() for _ in range(5)]
    assert [(answer.message, answer.reference) for answer in answers] == [
        (0x2203, 5), (0x2303, 1), (0x2202, 2), (0x2202, 3), (0x2202, 4),
    ]  # fmt: skip
    assert (answers[0].payload, answers[1].payload) == (b"\x07", b"\x05")


def test_a_taken_id(pdcpd: Pdcpd, connect: Connect, sensor: HandMade, join: Callable[[int], HandMade]) -> None:
    """[PDCP 3.2.1]: another identity that asks for it gets another suggested, on the id that it asked for."""
    bind(sensor, connect(pdcpd))
    other = join(0)
    other.send(0x645, "01 34 12 78 56 01 00")
    until(lambda: bool(other.received(0x345, 0x81)), "an answer to the second device")
    answer = other.received(0x345, 0x81)[0]
    suggested = answer[1]
    assert answer == bytes([0x81, suggested]) + bytes.fromhex("34 12 78 56 01 00")
    assert 1 <= suggested <= 254 and suggested != 0x45
    other.send(0x600 | suggested, "01 34 12 78 56 01 00")
    until(lambda: bool(other.received(0x300 | suggested, 0x81)), "an answer to the second request")
    assert other.received(0x300 | suggested, 0x81) == [answer]


@pytest.mark.parametrize("asked", [0, 255])
def test_an_id_that_is_none(asked: int, join: Callable[[int], HandMade]) -> None:
    """D-BUS-2, D-BUS-6: a request for 0 or 255 gets a suggestion."""
    device = join(0)
    device.send(0x600 | asked, SENSOR_ASKS)
    until(lambda: bool(device.received(0x300 | asked, 0x81)), "an answer")
    answer = device.received(0x300 | asked, 0x81)[0]
    assert answer[2:] == bytes.fromhex("34 12 78 56 BC 9A")
    assert 1 <= answer[1] <= 254


def test_a_twin_is_refused(pdcpd: Pdcpd, connect: Connect, sensor: HandMade, join: Callable[[int], HandMade]) -> None:
    """D-BUS-6: a second device with the identity of a living one is refused with id 0."""
    host = connect(pdcpd)
    bind(sensor, host)
    twin = join(0)
    twin.send(0x646, SENSOR_ASKS)
    until(lambda: bool(twin.received(0x346, 0x81)), "an answer to the twin")
    assert twin.received(0x346, 0x81) == [bytes.fromhex("81 00 34 12 78 56 BC 9A")]
    assert host.system_info() == (1, 0, 1, 0)


@pytest.mark.parametrize("wrong", ["01 34 12 78 56 BC", "01 34 12 78 56 BC 9A 00", "01", "0A", "02 34 12 78 56 BC 9A"])
def test_a_malformed_bind_request_is_not_answered(wrong: str, join: Callable[[int], HandMade]) -> None:
    """D-BUS-5: the first answer is the one to the good request behind it."""
    device = join(0)
    device.send(0x645, wrong)
    device.send(0x646, SENSOR_ASKS)
    until(lambda: bool(device.received(0x346, 0x81)), "an answer to the good request")
    assert [data for identifier, data in device.log if identifier & 0x100 and data[0] == 0x81] == [
        bytes.fromhex("81 46 34 12 78 56 BC 9A")
    ]


@pytest.mark.parametrize("beacons", [1, 20])
def test_three_beacons_missed(beacons: int, pdcpd: Pdcpd, connect: Connect, sensor: HandMade) -> None:
    """Gone after three of its beacon intervals without a frame, and not before (pdcp-bus.md 9); the interval that it
    told counts from the beginning, not the default of 500 ms. Everything by the clock of the arbitrator, and by its own
    beacons: three of them come in three intervals of 500 ms."""
    host = connect(pdcpd)
    bind(sensor, host)
    host.stream((EventKind.CAN_FRAME, EventKind.DEVICE_LOST))
    heard, last_ms, arbitrator_beacons = 0, 0, 0
    for event in host.events(LINE_TIMEOUT_S):
        if isinstance(event, DeviceLost):
            break
        assert isinstance(event, CanFrame)
        arbitrator_beacons += event.can_id == BEACON_OF_ARBITRATOR
        if event.can_id in (0x045, 0x245):  # any frame counts as life
            last_ms, arbitrator_beacons = event.time_ms, 0
        heard += event.can_id == 0x045
        if heard == beacons:
            sensor.die()
    else:
        pytest.fail("it was not lost")
    assert event.time_ms - last_ms >= 3 * BEACON_MS
    assert arbitrator_beacons < 3
    host.stream(())
    assert host.system_info() == (0, 0, 0, 0)
    with pytest.raises(RequestError) as error:
        host.device(1)
    assert error.value.code == 0x02


def test_a_longer_beacon_interval_is_heeded(pdcpd: Pdcpd, connect: Connect, sensor: HandMade) -> None:
    """A host that writes parameter 10 does not make the arbitrator lose the device."""
    host = connect(pdcpd)
    bind(sensor, host)
    host.set_parameter(ChannelId(SENSOR), 10, bytes.fromhex("D0 07"))
    sensor.parameters[(10, 0)] = bytes.fromhex("D0 07")
    sensor.beacons = False  # three times 2 s are left to it
    beacons = len(sensor.received(BEACON_OF_ARBITRATOR, 0x0A))
    until(lambda: len(sensor.received(BEACON_OF_ARBITRATOR, 0x0A)) >= beacons + 4, "1.5 s have passed on the bus")
    assert host.system_info().devices == 1, "lost before its next beacon was due"


def test_arbitrator_beacons(join: Callable[[int], HandMade]) -> None:
    """D-BUS-11: P=0, M=1, N=0, every 500 ms: three intervals in a row, as soon as the machine lets it."""
    device = join(0)

    def are_regular() -> bool:
        frames = zip(device.times_s, device.log, strict=False)
        times_s = [at_s for at_s, (identifier, _) in frames if identifier == BEACON_OF_ARBITRATOR]
        gaps_s = [later - earlier for earlier, later in pairwise(times_s[-4:])]
        return len(gaps_s) == 3 and all(0.45 <= gap_s <= 0.55 for gap_s in gaps_s)

    until(are_regular, "three intervals of 500 ms in a row")
    assert set(device.received(BEACON_OF_ARBITRATOR, 0x0A)) == {b"\x0a"}


def test_a_beacon_from_an_unknown_device(join: Callable[[int], HandMade]) -> None:
    """D-BUS-15: an id that is not bound is told to reset, but not in the arbitrator's first 1200 ms."""
    device = join(0x45)
    device.beacons = True
    until(lambda: bool(device.received(0x345, 0x0B)), "Reset Device")
    assert device.received(0x345, 0x0B)[0] == b"\x0b"
