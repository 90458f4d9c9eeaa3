"""Client and AsyncClient on a real pseudo-terminal, with an arbitrator that does as it is told. Every test runs with
both."""

import asyncio
import threading
import time
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from scripted import Script, ScriptedArbitrator

from pdcp import AsyncClient, Client, messages
from pdcp.errors import ConnectionFailedError, ErrorCode, NoAnswerError, PdcpError, RequestError, ResetError
from pdcp.events import DeviceBound, DeviceLost, Event, EventKind, LinkChanged
from pdcp.model import (
    Action,
    ArbitratorInfo,
    Channel,
    ChannelId,
    Device,
    Direction,
    Flags,
    Identity,
    Limits,
    Link,
    LinkStatus,
    ProfileState,
    SystemInfo,
)
from pdcp.wire import Frame, Receiver, encode

SENSOR, HAND = Identity(2, 2, 4), Identity(2, 2, 6)
SENSOR_BYTES, HAND_BYTES = bytes.fromhex("02 00 02 00 04 00"), bytes.fromhex("02 00 02 00 06 00")
OUTPUT, INPUT = ChannelId(SENSOR, 1), ChannelId(HAND, 2)
INFO_BYTES = bytes.fromhex("01 02 03 04 40 C8 64 02 01 03 13")
INFO = ArbitratorInfo(1, (2, 3, 4), Limits(64, 200, 100), ProfileState.RUNNING, 1, 3, Flags(0x13))

LONG_S = 1000.0  # a wait that does not end with its event outlasts the test (tests/CMakeLists.txt)

Make = Callable[[Script], ScriptedArbitrator]
Operation = Callable[[Any], Any]  # of a client of either kind: returns a value, or an awaitable of one
Run = Callable[..., Any]


def run_sync(port: str, *operations: Operation, **options: Any) -> list[Any]:  # noqa: ANN401 - those of the client
    with Client(port, **options) as client:
        return [operation(client) for operation in operations]


def run_async(port: str, *operations: Operation, **options: Any) -> list[Any]:  # noqa: ANN401
    async def run() -> list[Any]:
        async with AsyncClient(port, **options) as client:
            return [await operation(client) for operation in operations]

    return asyncio.run(run())


@pytest.fixture(params=[run_sync, run_async], ids=["sync", "async"])
def run(request: pytest.FixtureRequest) -> Run:
    """run(PORT, OPERATION..., OPTIONS): what the operations return, one client for all."""
    chosen: Run = request.param
    return chosen


def answers(rows: dict[tuple[int, bytes], tuple[int, bytes]]) -> Script:
    """A script by request; anything else is out of range."""

    def script(frame: Frame) -> list[Frame]:
        found = rows.get((frame.message, frame.payload))
        if found is None:
            return [Frame(frame.message + 2, frame.reference, b"\x02")]
        return [Frame(found[0], frame.reference, found[1])]

    return script


ROWS: list[tuple[str, Operation, bytes, int, int, bytes, Any]] = [
    # what, operation, payload of the request, its id, id and payload of the answer, result
    ("system info", lambda c: c.system_info(), b"", 0x2201, 0x2202, b"\x03\x04\x05\x01", SystemInfo(3, 4, 5, 1)),
    (
        "device",
        lambda c: c.device(2),
        b"\x02",
        0x2204,
        0x2205,
        HAND_BYTES + b"\x00\x11\x22\x33\x44",
        Device(2, HAND, 0x2211, 0x4433),
    ),
    (
        "input",
        lambda c: c.input(1),
        b"\x01",
        0x2207,
        0x2208,
        HAND_BYTES + bytes.fromhex("02 00 73 20 12"),
        Channel(1, Direction.INPUT, INPUT, 0x7300, 0x1220),
    ),
    (
        "output",
        lambda c: c.output(1),
        b"\x01",
        0x220A,
        0x220B,
        SENSOR_BYTES + bytes.fromhex("01 00 50 20 21"),
        Channel(1, Direction.OUTPUT, OUTPUT, 0x5000, 0x2120),
    ),
    (
        "link info",
        lambda c: c.link_info(1),
        b"\x01",
        0x220D,
        0x220E,
        SENSOR_BYTES + b"\x01" + HAND_BYTES + b"\x02\x01",
        Link(1, OUTPUT, INPUT, LinkStatus.INACTIVE),
    ),
    ("get", lambda c: c.get_parameter(INPUT, 2), HAND_BYTES + b"\x02\x02", 0x2301, 0x2302, b"grip", b"grip"),
    ("get nothing", lambda c: c.get_parameter(INPUT, 2), HAND_BYTES + b"\x02\x02", 0x2301, 0x2302, b"", b""),
    ("set", lambda c: c.set_parameter(INPUT, 4, b"\x01"), HAND_BYTES + b"\x02\x04\x01", 0x2304, 0x2305, b"", None),
    (
        "link",
        lambda c: c.link(OUTPUT, INPUT),
        SENSOR_BYTES + b"\x01" + HAND_BYTES + b"\x02",
        0x2307,
        0x2308,
        b"\x02",
        LinkStatus.ACTIVE,
    ),
    (
        "passthrough",
        lambda c: c.passthrough(HAND, b"\x03\x09\x00"),
        HAND_BYTES + bytes.fromhex("03 03 09 00 00 00 00 00 00"),
        0x230A,
        0x230B,
        HAND_BYTES + bytes.fromhex("05 83 01 09 00 02 00 00 00"),
        bytes.fromhex("83 01 09 00 02"),
    ),
    (
        "suspend one",
        lambda c: c.suspend(HAND, 1000),
        HAND_BYTES + bytes.fromhex("03 08 E8 03 00 00 00 00 00"),
        0x230A,
        0x230B,
        HAND_BYTES + bytes.fromhex("04 88 01 E8 03 00 00 00 00"),
        None,
    ),
    (
        "suspend all",
        lambda c: c.suspend(),
        bytes.fromhex("00 00 00 00 00 00 03 08 00 00 00 00 00 00 00"),
        0x230A,
        0x230B,
        bytes.fromhex("00 00 00 00 00 00 03 08 00 00 00 00 00 00 00"),
        None,
    ),
    (
        "release one, with a short answer",
        lambda c: c.release(HAND),
        HAND_BYTES + bytes.fromhex("01 09 00 00 00 00 00 00 00"),
        0x230A,
        0x230B,
        HAND_BYTES + bytes.fromhex("01 89 00 00 00 00 00 00 00"),
        None,
    ),
    ("info", lambda c: c.info(), b"", 0x2401, 0x2402, INFO_BYTES, INFO),
    ("flags", lambda c: c.set_flags(Flags.HOT_SWAP | Flags.AUTO_SAVE), b"\x06", 0x2404, 0x2405, b"", None),
    ("action", lambda c: c.action(Action.LOAD, 3), b"\x02\x03", 0x2407, 0x2408, b"\x02\x01", 0x0102),
    ("unlink", lambda c: c.unlink(INPUT), HAND_BYTES + b"\x02", 0x2410, 0x2411, b"", None),
    ("stream", lambda c: c.stream([EventKind.DEVICE_BOUND, EventKind.BUS_STATE]), b"\x21", 0x2416, 0x2417, b"", None),
    ("stream audit", lambda c: c.stream([EventKind.AUDIT]), b"\x00\x01", 0x2416, 0x2417, b"", None),
    ("stream off", lambda c: c.stream([]), b"\x00", 0x2416, 0x2417, b"", None),
]


@pytest.mark.parametrize(("operation", "payload", "request_id", "answer_id", "answer", "result"),
                         [row[1:] for row in ROWS], ids=[row[0] for row in ROWS])  # fmt: skip
def test_operations(
    operation: Operation,
    payload: bytes,
    request_id: int,
    answer_id: int,
    answer: bytes,
    result: object,
    run: Run,
    arbitrator: Make,
) -> None:
    """Bytes by hand on both sides."""
    peer = arbitrator(answers({(request_id, payload): (answer_id, answer)}))
    assert run(peer.port, operation) == [result]
    assert [(frame.message, frame.payload) for frame in peer.requests] == [(request_id, payload)]


def test_tables_end_where_numbers_do(run: Run, arbitrator: Make) -> None:
    rows = {
        (0x2204, bytes([number])): (0x2205, SENSOR_BYTES + b"\0" + bytes([number, 0, 0, 0])) for number in (1, 2, 3)
    }
    peer = arbitrator(answers(rows))
    devices, links = run(peer.port, lambda c: c.devices(), lambda c: c.links())
    assert [(each.number, each.type) for each in devices] == [(1, 1), (2, 2), (3, 3)]
    assert links == []


def test_another_error_is_not_the_end_of_a_table(run: Run, arbitrator: Make) -> None:
    peer = arbitrator(lambda frame: [Frame(frame.message + 2, frame.reference, b"\x0c")])
    with pytest.raises(RequestError) as error:
        run(peer.port, lambda c: c.devices())
    assert error.value.code is ErrorCode.CRC


def test_a_device_that_refuses_to_be_suspended(run: Run, arbitrator: Make) -> None:
    answer = HAND_BYTES + bytes.fromhex("04 88 00 00 00 00 00 00 00")
    peer = arbitrator(lambda frame: [Frame(0x230B, frame.reference, answer)])
    with pytest.raises(RequestError) as error:
        run(peer.port, lambda c: c.suspend(HAND))
    assert error.value.code is ErrorCode.DEVICE_REFUSED


@pytest.mark.parametrize("time_ms", [-1, 65536])
def test_a_time_that_no_message_can_carry(run: Run, arbitrator: Make, time_ms: int) -> None:
    peer = arbitrator(lambda _: [])
    with pytest.raises(messages.FormatError, match=f"{time_ms} ms"):
        run(peer.port, lambda c: c.suspend(HAND, time_ms))
    assert peer.requests == []


def test_reset_names_those_that_were_not(run: Run, arbitrator: Make) -> None:
    rows = {
        (0x2204, b"\x01"): (0x2205, SENSOR_BYTES + bytes(5)),
        (0x2204, b"\x02"): (0x2205, HAND_BYTES + bytes(5)),
        (0x230D, b"\x00"): (0x230F, b"\x01" + bytes(7)),
        (0x230D, b"\x02"): (0x230E, b""),
    }
    peer = arbitrator(answers(rows))
    with pytest.raises(ResetError, match="not reset: 2:2:6") as error:
        run(peer.port, lambda c: c.reset())
    assert error.value.devices == (HAND,)
    assert run(peer.port, lambda c: c.reset(HAND)) == [None]
    with pytest.raises(RequestError) as unknown:
        run(peer.port, lambda c: c.reset(Identity(9, 9, 9)))
    assert unknown.value.code is ErrorCode.UNKNOWN_DEVICE


def test_flags_that_are_changed(run: Run, arbitrator: Make) -> None:
    """The others stay; bit 4 is not written."""
    peer = arbitrator(answers({(0x2401, b""): (0x2402, INFO_BYTES), (0x2404, b"\x06"): (0x2405, b"")}))
    (flags,) = run(peer.port, lambda c: c.change_flags(on=Flags.AUTO_SAVE, off=Flags.AUTOCONFIGURE))
    assert flags == Flags.HOT_SWAP | Flags.AUTO_SAVE | Flags.EVENT_STREAM


STORED = bytes(range(256)) + b"end"


def test_configurations_come_in_pieces(run: Run, arbitrator: Make) -> None:
    """240Ah: at most 128 bytes; 240Dh likewise."""

    def script(frame: Frame) -> list[Frame]:
        if frame.message == 0x240D:
            return [Frame(0x240E, frame.reference)]
        offset = int.from_bytes(frame.payload[:2], "little")
        head = len(STORED).to_bytes(2, "little") + frame.payload[:2]
        return [Frame(0x240B, frame.reference, head + STORED[offset : offset + frame.payload[2]])]

    peer = arbitrator(script)
    steps: list[tuple[int, int]] = []
    (found, _) = run(
        peer.port,
        lambda c: c.read_configurations(lambda done, of: steps.append((done, of))),
        lambda c: c.write_configurations(STORED),
    )
    assert found == STORED
    assert steps == [(128, 259), (256, 259), (259, 259)]
    written = [frame.payload for frame in peer.requests if frame.message == 0x240D]
    assert written == [
        bytes.fromhex("00 00 03 01") + STORED[:128],
        bytes.fromhex("80 00 03 01") + STORED[128:256],
        bytes.fromhex("00 01 03 01") + STORED[256:],
    ]


def test_no_configurations(run: Run, arbitrator: Make) -> None:
    peer = arbitrator(answers({(0x240A, b"\0\0\x80"): (0x240B, bytes(4))}))
    assert run(peer.port, lambda c: c.read_configurations()) == [b""]


@pytest.mark.parametrize(
    ("answer", "what"),
    [
        ("03 00 80 00 01 02 03", "at 128 instead of 0"),
        ("03 01 00 00", "end after 0 of 259"),
        ("01 00 00 00 01 02", "a piece of stored configurations"),
    ],
)
def test_pieces_that_do_not_fit(answer: str, what: str, run: Run, arbitrator: Make) -> None:
    peer = arbitrator(lambda frame: [Frame(0x240B, frame.reference, bytes.fromhex(answer))])
    with pytest.raises(PdcpError, match=what):
        run(peer.port, lambda c: c.read_configurations())


def test_statistics(run: Run, arbitrator: Make) -> None:
    """More counters than there are names for, and groups until there are no more."""
    many = b"".join(number.to_bytes(4, "little") for number in range(40))
    peer = arbitrator(answers({(0x2413, b"\0"): (0x2414, b"\0" + many), (0x2413, b"\1"): (0x2414, b"\1" + many[:8])}))
    ((bus, host),) = run(peer.port, lambda c: c.all_stats())
    assert (bus.name, host.name) == ("bus", "host")
    assert bus["rx"] == 0 and bus["tx"] == 1 and bus["audit"] == 35 and bus["counter_36"] == 36
    assert [counter.value for counter in host.counters] == [0, 1]


# --- time ---


def test_a_silent_arbitrator(run: Run, arbitrator: Make) -> None:
    """What reads is asked twice, with two references."""
    peer = arbitrator(lambda frame: [])
    start_s = time.monotonic()
    with pytest.raises(NoAnswerError, match="0.1 s"):
        run(peer.port, lambda c: c.system_info(), timeout_s=0.1)
    assert time.monotonic() - start_s >= 0.2
    assert len({frame.reference for frame in peer.requests}) == len(peer.requests) == 2
    with pytest.raises(NoAnswerError):
        run(peer.port, lambda c: c.unlink(INPUT), timeout_s=0.1)
    assert len(peer.requests) == 3


def test_an_answer_in_the_midst_of_garbage(run: Run, arbitrator: Make) -> None:
    peer: ScriptedArbitrator

    def script(frame: Frame) -> list[Frame]:
        peer.send(b"\xfe\xfe\x19\x02\x22hello\xfe")
        return [Frame(0x2202, frame.reference ^ 0x80, b"\x09\x09\x09\x09"), Frame(0x2202, frame.reference, bytes(4))]

    peer = arbitrator(script)
    assert run(peer.port, lambda c: c.system_info()) == [SystemInfo(0, 0, 0, 0)]


class Interrupted:
    """A line on which Ctrl-C comes before each of the first answers."""

    def __init__(self, times: int) -> None:
        self._left = times
        self._answers = b""

    def read(self, timeout_s: float) -> bytes:
        if self._left:
            self._left -= 1
            raise KeyboardInterrupt
        answers, self._answers = self._answers, b""
        assert answers, "nothing was asked"
        return answers

    def write(self, data: bytes) -> None:
        for frame in Receiver().on_bytes(data, 0.0) if not self._left else []:
            self._answers += encode(0x2202, frame.reference, bytes([frame.reference, 0, 0, 0]))

    def close(self) -> None:
        pass


def test_interrupted_requests_leave_nothing_behind() -> None:
    """As many as the arbitrator holds, and one more."""
    client = Client(Interrupted(5), timeout_s=1000.0)
    for _ in range(5):
        with pytest.raises(KeyboardInterrupt):
            client.system_info()
    first = client.system_info().devices
    assert client.system_info().devices == first % 255 + 1


# --- the port ---


def test_no_such_port(run: Run) -> None:
    with pytest.raises(ConnectionFailedError, match="cannot open /nosuch: No such file"):
        run("/nosuch", lambda c: c.system_info())


def test_no_serial_port(run: Run) -> None:
    with pytest.raises(ConnectionFailedError, match="it is no serial port"):
        run(__file__, lambda c: c.system_info())


def test_a_port_in_use(run: Run, arbitrator: Make) -> None:
    peer = arbitrator(answers({}))
    with (
        Client(peer.port),
        pytest.raises(ConnectionFailedError, match="another program has it open"),
    ):
        run(peer.port, lambda c: c.system_info())


def test_what_another_host_left_is_not_read(run: Run, arbitrator: Make) -> None:
    peer = arbitrator(answers({(0x2201, b""): (0x2202, b"\x01\x02\x03\x04")}))
    for reference in range(256):
        peer.send(encode(0x2202, reference, bytes(4)))
    assert run(peer.port, lambda c: c.system_info()) == [SystemInfo(1, 2, 3, 4)]


# --- events ---


def test_events_come_with_answers(run: Run, arbitrator: Make) -> None:
    """Before, in between and afterwards; they end when none has come for the time given."""
    bound = Frame(0x2419, 0, b"\x01\x01\0\0\0" + HAND_BYTES + b"\x10")
    lost = Frame(0x2419, 0, b"\x02\x02\0\0\0" + HAND_BYTES + b"\x10")
    linked = Frame(0x2419, 0, b"\x03\x03\0\0\0" + SENSOR_BYTES + b"\x01" + HAND_BYTES + b"\x02\x02")

    def script(frame: Frame) -> list[Frame]:
        if frame.message == messages.StreamEvents.ID:
            return [Frame(0x2417, frame.reference), bound]
        return [lost, Frame(0x2202, frame.reference, bytes(4)), linked]

    peer = arbitrator(script)
    expected = [
        DeviceBound(1, 1, HAND, 16),
        DeviceLost(2, 2, HAND, 16),
        LinkChanged(3, 3, OUTPUT, INPUT, LinkStatus.ACTIVE),
    ]
    if run is run_sync:
        with Client(peer.port) as client:
            client.stream()
            found: list[Event] = []
            for event in client.events(0.3):
                if not found:
                    assert client.system_info() == SystemInfo(0, 0, 0, 0)
                found.append(event)
    else:

        async def listen() -> list[Event]:
            async with AsyncClient(peer.port) as client:
                await client.stream()
                heard: list[Event] = []
                async for event in client.events(0.3):
                    if not heard:
                        assert await client.system_info() == SystemInfo(0, 0, 0, 0)
                    heard.append(event)
                return heard

        found = asyncio.run(listen())
    assert found == expected
    assert peer.requests[0].payload == b"\x2f\x01"  # all but CAN frames


def test_an_event_that_is_waited_for(run: Run, arbitrator: Make) -> None:
    """It comes while nobody asks for anything, and nobody waits until the time is over."""
    peer = arbitrator(answers({}))
    sender = threading.Timer(0.1, peer.send, [encode(0x2419, 0, b"\x02\x02\0\0\0" + HAND_BYTES + b"\x10")])

    async def listen() -> Event:
        async with AsyncClient(peer.port) as client:
            sender.start()
            return await anext(client.events(LONG_S))

    if run is run_sync:
        with Client(peer.port) as client:
            sender.start()
            event = next(client.events(LONG_S))
    else:
        event = asyncio.run(listen())
    assert event == DeviceLost(2, 2, HAND, 16)


# --- asyncio ---


def test_waiting_for_events_ends_with_the_line(arbitrator: Make) -> None:
    peer: ScriptedArbitrator

    def script(frame: Frame) -> list[Frame]:
        peer.unplug()
        return []

    peer = arbitrator(script)

    async def next_event(client: AsyncClient) -> Event:
        return await anext(client.events(LONG_S))

    async def listen() -> None:
        async with AsyncClient(peer.port) as client:
            waiting = asyncio.create_task(next_event(client))
            await asyncio.sleep(0)
            with pytest.raises(ConnectionFailedError, match="gone"):
                await client.system_info()
            with pytest.raises(ConnectionFailedError, match="gone"):
                await waiting

    asyncio.run(listen())


def test_tasks_share_the_line(arbitrator: Make) -> None:
    """Twenty requests at once, four of them under way; each gets its own answer."""
    peer = arbitrator(lambda frame: [Frame(0x2205, frame.reference, SENSOR_BYTES + b"\0" + frame.payload + b"\0\0\0")])

    async def ask() -> list[Device]:
        async with AsyncClient(peer.port) as client:
            return await asyncio.gather(*(client.device(number) for number in range(1, 21)))

    assert [(each.number, each.type) for each in asyncio.run(ask())] == [(number, number) for number in range(1, 21)]


def test_a_cancelled_request_leaves_nothing_behind(arbitrator: Make) -> None:
    peer = arbitrator(lambda frame: [Frame(0x2202, frame.reference, bytes(4))] if frame.message == 0x2201 else [])

    async def ask() -> SystemInfo:
        async with AsyncClient(peer.port) as client:
            # As many as the arbitrator holds, and one more.
            cancelled = [asyncio.wait_for(client.get_parameter(INPUT, 2), 0.05) for _ in range(5)]
            ends = await asyncio.gather(*cancelled, return_exceptions=True)
            assert [type(end) for end in ends] == [TimeoutError] * 5
            return await client.system_info()

    assert asyncio.run(ask()) == SystemInfo(0, 0, 0, 0)


def test_async_client_that_is_closed(arbitrator: Make) -> None:
    peer = arbitrator(lambda frame: [])

    async def ask(use: Callable[[AsyncClient], Awaitable[Any]]) -> None:
        client = AsyncClient(peer.port)
        await client.open()
        task = asyncio.ensure_future(use(client))
        await asyncio.sleep(0)
        await client.close()
        with pytest.raises(ConnectionFailedError, match="closed"):
            await task
        with pytest.raises(ConnectionFailedError, match="closed"):
            await client.system_info()

    asyncio.run(ask(lambda client: client.system_info()))


def test_the_line_goes_while_it_is_used(run: Run, arbitrator: Make) -> None:
    peer: ScriptedArbitrator

    def script(frame: Frame) -> list[Frame]:
        peer.unplug()
        return []

    peer = arbitrator(script)
    with pytest.raises(ConnectionFailedError, match="gone"):
        run(peer.port, lambda c: c.system_info(), timeout_s=5.0)
