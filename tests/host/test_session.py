"""pdcp.session in virtual time: references, time-outs, repetition of reads, order, events."""

import heapq
import random
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdcp import messages as m
from pdcp.errors import (
    BadAnswerError,
    ConnectionFailedError,
    ErrorCode,
    NoAnswerError,
    PdcpError,
    RequestError,
    ResetError,
    UnknownMessageError,
)
from pdcp.events import BusState, BusStateChanged, DeviceBound
from pdcp.model import ChannelId, Identity
from pdcp.session import EVENTS_MAX, HELD_BYTES, Session, Ticket
from pdcp.wire import Frame, Receiver, encode

SENSOR = Identity(2, 2, 4)
SET = m.SetParameter(ChannelId(SENSOR), 10, b"\xf4\x01")
ONE_LINK = bytes([3, 4, 4, 1])


class Line:
    """A session and its time. What it sends is kept as frames; the test answers by hand."""

    def __init__(self, **options: Any) -> None:  # noqa: ANN401 - those of Session
        self.now_s = 100.0
        self.session = Session(first_reference=1, **options)
        self._receiver = Receiver()

    def submit(self, request: m.Request[Any]) -> Ticket[Any]:
        return self.session.submit(request, self.now_s)

    def sent(self) -> list[Frame]:
        return self._receiver.on_bytes(self.session.take_output(), self.now_s)

    def answer(self, message: int, reference: int, payload: bytes = b"") -> None:
        self.session.on_bytes(encode(message, reference, payload), self.now_s)

    def pass_time(self, seconds: float) -> None:
        """Calls on_time whenever the session wants it."""
        end_s = self.now_s + seconds
        while (next_s := self.session.next_s) is not None and next_s <= end_s:
            self.now_s = max(self.now_s, next_s)
            self.session.on_time(self.now_s)
        self.now_s = end_s
        self.session.on_time(end_s)


def error_of(ticket: Ticket[Any]) -> PdcpError:
    with pytest.raises(PdcpError) as error:
        ticket.result()
    return error.value


def test_an_answer() -> None:
    line = Line()
    ticket = line.submit(m.GetSystemInfo())
    assert line.sent() == [Frame(0x2201, 1)]
    assert not ticket.done
    line.answer(0x2202, 1, ONE_LINK)
    assert ticket.result() == m.SystemInfoSuccess(3, 4, 4, 1)
    assert line.session.next_s is None


def test_a_reference_of_nobody() -> None:
    """It answers a request that was given up, or another host's."""
    line = Line()
    ticket = line.submit(m.GetSystemInfo())
    line.answer(0x2202, 2, bytes(4))
    assert not ticket.done
    assert line.session.strays == 1
    line.answer(0x2202, 1, ONE_LINK)
    assert ticket.result().links == 1


def test_a_read_is_sent_again() -> None:
    """Once, with another reference; then it fails."""
    line = Line(timeout_s=4.0)
    ticket = line.submit(m.GetDeviceInfo(1))
    assert line.sent() == [Frame(0x2204, 1, b"\x01")]
    line.pass_time(3.99)
    assert line.sent() == []
    line.pass_time(0.02)
    assert line.sent() == [Frame(0x2204, 2, b"\x01")]
    line.answer(0x2206, 1, b"\x02")  # late: nobody waits for it any more
    assert not ticket.done
    line.pass_time(4.01)
    assert line.sent() == []
    assert isinstance(error_of(ticket), NoAnswerError)
    assert "4 s" in str(error_of(ticket))


def test_the_second_try_is_answered() -> None:
    line = Line()
    ticket = line.submit(m.GetDeviceInfo(1))
    line.pass_time(4.5)
    assert [frame.reference for frame in line.sent()] == [1, 2]
    line.answer(0x2205, 2, bytes.fromhex("02 00 02 00 04 00 00 00 00 00 00"))
    assert ticket.result().channel == ChannelId(SENSOR)


def test_a_write_is_not_sent_again() -> None:
    """Nobody knows whether it was carried out."""
    line = Line()
    ticket = line.submit(SET)
    assert len(line.sent()) == 1
    line.pass_time(4.01)
    assert line.sent() == []
    assert isinstance(error_of(ticket), NoAnswerError)
    line.pass_time(60)
    assert line.sent() == []


def test_no_retries() -> None:
    line = Line(read_retries=0)
    ticket = line.submit(m.GetSystemInfo())
    line.pass_time(4.01)
    assert isinstance(error_of(ticket), NoAnswerError)
    assert len(line.sent()) == 1


def test_four_are_under_way() -> None:
    """D-API-3: the arbitrator holds four; the fifth is sent when there is room."""
    line = Line()
    tickets = [line.submit(m.GetDeviceInfo(number)) for number in range(1, 7)]
    assert [frame.payload[0] for frame in line.sent()] == [1, 2, 3, 4]
    line.answer(0x2206, 1, b"\x02")
    assert tickets[0].done and not tickets[1].done
    assert [frame.payload[0] for frame in line.sent()] == [5]


def test_long_requests_wait_for_each_other() -> None:
    """D-API-9: the arbitrator holds so many bytes of payloads."""
    line = Line()
    long = m.SetParameter(ChannelId(SENSOR), 7, bytes(512))
    assert 2 * len(long.pack()) > HELD_BYTES
    line.submit(long)
    line.submit(long)
    assert len(line.sent()) == 1
    line.answer(0x2305, 1)
    assert len(line.sent()) == 1


def test_requests_wait_for_their_turn() -> None:
    """Four writes that the arbitrator serves one after the other, three seconds each."""
    line = Line(timeout_s=4.0)
    tickets = [line.submit(SET) for _ in range(4)]
    for reference in range(1, 5):
        line.pass_time(3.0)
        line.answer(0x2305, reference)
    for ticket in tickets:
        assert ticket.result() == m.SetParameterSuccess()


def test_what_was_overtaken_is_lost() -> None:
    """Answers come in order: that to the second says that the first one's is lost. A read is asked again at once."""
    line = Line()
    read, write, last = line.submit(m.GetSystemInfo()), line.submit(SET), line.submit(m.GetDeviceInfo(1))
    assert len(line.sent()) == 3
    line.answer(0x2206, 3, b"\x02")
    assert isinstance(error_of(last), RequestError)
    assert isinstance(error_of(write), NoAnswerError)
    assert not read.done
    assert line.sent() == [Frame(0x2201, 4)]
    line.answer(0x2202, 4, ONE_LINK)
    assert read.result().links == 1


def test_busy_overtakes() -> None:
    """D-API-3: error 07h is the one answer out of order."""
    line = Line()
    first, second = line.submit(SET), line.submit(SET)
    line.answer(0x2306, 2, b"\x07")
    assert not first.done
    error = error_of(second)
    assert isinstance(error, RequestError) and error.code is ErrorCode.BUSY
    line.answer(0x2305, 1)
    assert first.result() == m.SetParameterSuccess()


@pytest.mark.parametrize("code", range(1, 16))
def test_failure_answers(code: int) -> None:
    """D-API-4: the code and what it means."""
    line = Line()
    ticket = line.submit(SET)
    line.answer(0x2306, 1, bytes([code]))
    error = error_of(ticket)
    assert isinstance(error, RequestError)
    assert error.code is ErrorCode(code)
    assert error.message == 0x2304
    assert f"({'error'} {code:02X}h)" in str(error) and "unknown error" not in str(error)


def test_a_code_of_the_future() -> None:
    line = Line()
    ticket = line.submit(SET)
    line.answer(0x2306, 1, b"\x42")
    error = error_of(ticket)
    assert isinstance(error, RequestError) and error.code == 0x42
    assert str(error) == "unknown error (error 42h)"


def test_a_message_that_the_arbitrator_does_not_know() -> None:
    line = Line()
    ticket = line.submit(m.GetArbitratorInfo())
    line.answer(0x2200, 1)
    error = error_of(ticket)
    assert isinstance(error, UnknownMessageError)
    assert "2401h" in str(error)


def test_reset_results() -> None:
    """230Fh: bit 0 of the first byte is device 1, cleared: not reset."""
    line = Line()
    ticket = line.submit(m.Reset(0))
    line.answer(0x230F, 1, bytes.fromhex("05 00 00 00 00 00 00 80"))
    error = error_of(ticket)
    assert isinstance(error, ResetError)
    assert [number for number in range(1, 65) if error.was_reset(number)] == [1, 3, 64]


@pytest.mark.parametrize(
    ("message", "payload"),
    [
        (0x2202, b""),
        (0x2202, bytes(5)),
        (0x2203, b""),
        (0x2205, bytes(11)),
        (0x2206, b"\x02"),
        (0x2201, b""),
        (0x3333, b""),
    ],
)
def test_answers_that_are_none(message: int, payload: bytes) -> None:
    line = Line()
    ticket = line.submit(m.GetSystemInfo())
    line.answer(message, 1, payload)
    error = error_of(ticket)
    assert isinstance(error, BadAnswerError)
    assert "2201h" in str(error)


def test_events() -> None:
    """They have reference 0 and disturb no request."""
    line = Line()
    ticket = line.submit(m.GetSystemInfo())
    line.answer(0x2419, 0, bytes.fromhex("01 E8 03 00 00 02 00 02 00 04 00 10"))
    line.answer(0x2419, 0, bytes.fromhex("06 E9 03 00 00 02 80 FF"))
    line.answer(0x2419, 0, bytes.fromhex("01 E8 03 00 00 02"))  # too short
    line.answer(0x2419, 9, bytes.fromhex("01 E8 03 00 00 02 00 02 00 04 00 10"))  # an answer to nobody
    assert not ticket.done
    assert list(line.session.events) == [
        DeviceBound(1, 1000, SENSOR, 16),
        BusStateChanged(6, 1001, BusState.OFF, 128, 255),
    ]
    assert line.session.strays == 2


def test_events_that_nobody_takes() -> None:
    """The oldest go."""
    line = Line()
    data = b"".join(
        encode(0x2419, 0, b"\x04" + number.to_bytes(4, "little") + b"\x00\x00") for number in range(EVENTS_MAX + 3)
    )
    line.session.on_bytes(data, line.now_s)
    assert len(line.session.events) == EVENTS_MAX
    assert line.session.events[0].time_ms == 3
    assert line.session.events_lost == 3


def test_the_line_is_gone() -> None:
    line = Line()
    tickets = [line.submit(m.GetSystemInfo()) for _ in range(6)]
    line.session.fail_all(ConnectionFailedError("unplugged"))
    for ticket in tickets:
        assert isinstance(error_of(ticket), ConnectionFailedError)
    assert line.session.next_s is None


def test_a_ticket_that_nobody_wants() -> None:
    line = Line()
    tickets = [line.submit(m.GetDeviceInfo(number)) for number in range(1, 7)]
    line.session.forget(tickets[0])
    line.session.forget(tickets[5])
    line.pass_time(0.5)
    assert [frame.payload[0] for frame in line.sent()] == [1, 2, 3, 4, 5]
    line.answer(0x2206, 1, b"\x02")
    assert line.session.strays == 1
    assert not tickets[0].done


def test_references() -> None:
    """From 1 to 255, and never one that is under way."""
    line = Line()
    slow = line.submit(SET)
    used = [line.sent()[0].reference]
    for _ in range(600):
        line.submit(m.GetSystemInfo())
        used += [frame.reference for frame in line.sent()]
        line.answer(0x2203, used[-1], b"\x07")  # busy: overtakes the slow one
    assert set(used) == set(range(1, 256))
    assert used.count(1) == 1
    assert not slow.done
    assert all(a != b for a, b in zip(used, used[1:], strict=False))


def test_first_references_differ() -> None:
    """Answers to a host before this one are not taken for its own."""
    starts = set()
    for _ in range(50):
        session = Session()
        session.submit(m.GetSystemInfo(), 0.0)
        starts.add(session.take_output()[4])
    assert len(starts) > 10


def test_values_that_do_not_fit_are_refused_at_once() -> None:
    line = Line()
    with pytest.raises(m.FormatError):
        line.submit(m.GetDeviceInfo(300))
    with pytest.raises(m.FormatError, match="521 bytes"):
        line.submit(m.SetParameter(ChannelId(SENSOR), 7, bytes(513)))
    assert line.sent() == []


# --- anything at all ---


class Arbitrator:
    """Serves in order, four at a time, each taking its time; bytes may be lost or turn up in pieces, both ways."""

    def __init__(self, chance: random.Random, loss: float) -> None:
        self.carried_out: list[tuple[int, bytes]] = []
        self._chance = chance
        self._loss = loss
        self._receiver = Receiver()
        self._free_s = 0.0

    def on_bytes(self, data: bytes, now_s: float) -> list[tuple[float, bytes]]:
        """What it sends for that, and when."""
        if self._chance.random() < self._loss:
            data = data[: self._chance.randrange(len(data))]
        sent = []
        for frame in self._receiver.on_bytes(data, now_s):
            if len(frame.payload) == 1:
                self._free_s = max(self._free_s, now_s) + self._chance.choice([0.001, 0.3, 2.9])
                self.carried_out.append((frame.message, frame.payload))
                answer = encode(frame.message + 1, frame.reference, self._payload(frame))
                if self._chance.random() < self._loss:
                    answer = answer[: self._chance.randrange(len(answer))]
                cut = self._chance.randrange(len(answer) + 1)
                sent += [(self._free_s, answer[:cut]), (self._free_s + 0.0005, answer[cut:])]
        return sent

    def _payload(self, frame: Frame) -> bytes:
        # The answer holds what was asked, so that a mix-up shows.
        if frame.message == m.GetDeviceInfo.ID:
            return bytes([0] * 6) + b"\0" + frame.payload + b"\0\0\0"
        return b""


@given(st.integers(0, 2**32), st.lists(st.booleans(), min_size=1, max_size=12), st.sampled_from([0.0, 0.1, 0.5, 1.0]))
def test_each_request_has_one_end(seed: int, writes: list[bool], loss: float) -> None:
    """Whatever is lost: every ticket is done once, with its own answer or with an error; a write is carried out once at
    most, and an answered one once; without loss nothing fails."""
    chance = random.Random(seed)
    session = Session(first_reference=chance.randrange(1, 256))
    arbitrator = Arbitrator(chance, loss)
    now_s = 0.0
    ends: list[int] = []
    tickets: list[Ticket[Any]] = []
    for number, writes_it in enumerate(writes):
        # 2404h writes one byte, 2204h reads by one.
        ticket: Ticket[Any] = session.submit(m.SetFlags(number) if writes_it else m.GetDeviceInfo(number), now_s)
        ticket.on_done = _note(ends, number)
        tickets.append(ticket)
    due: list[tuple[float, int, bytes]] = []
    order = 0
    for _ in range(500):
        output = session.take_output()
        for when_s, data in arbitrator.on_bytes(output, now_s) if output else []:
            order += 1
            heapq.heappush(due, (when_s, order, data))
        times = [each for each in (session.next_s, due[0][0] if due else None) if each is not None]
        if not times:
            break
        now_s = max(now_s, min(times))
        while due and due[0][0] <= now_s:
            session.on_bytes(heapq.heappop(due)[2], now_s)
        session.on_time(now_s)
    assert sorted(ends) == list(range(len(writes)))
    for number, (ticket, writes_it) in enumerate(zip(tickets, writes, strict=True)):
        times_done = arbitrator.carried_out.count((ticket.request.ID, bytes([number])))
        try:
            answer = ticket.result()
        except NoAnswerError:
            assert loss > 0
            assert times_done <= (1 if writes_it else 2)
        else:
            assert times_done == 1 or not writes_it
            assert writes_it or answer.type == number


def _note(ends: list[int], number: int) -> Callable[[], None]:
    return lambda: ends.append(number)
