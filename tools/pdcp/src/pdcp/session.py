"""The host's end of the conversation, without any input or output: requests and bytes go in with the time, bytes and
results come out. Client and AsyncClient both drive this.

Several requests may be under way; answers are matched by their reference. The arbitrator answers in order (D-API-3),
so that an answer to a later request says that an earlier one was lost. What only reads is then sent again, once by
default; what changes something is not: nobody knows whether it was carried out.

Times are seconds of any clock that does not go back.
"""

import os
from collections import deque
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from . import events
from .errors import BadAnswerError, ErrorCode, NoAnswerError, PdcpError, RequestError, ResetError, UnknownMessageError
from .messages import EventMessage, Failure, FormatError, Message, Request, ResetFailure, UnknownId, unpack
from .wire import PAYLOAD_MAX, Frame, Receiver, encode

TIMEOUT_S = 4.0  # the arbitrator needs 3 s at most
READ_RETRIES = 1
HELD_MAX = 4  # requests that the arbitrator holds (D-API-3)
HELD_BYTES = 592  # of their payloads (D-API-9)
EVENTS_MAX = 10_000  # that wait for somebody to take them
REFERENCES = 255  # 1 to 255; 0 belongs to unasked messages

AnswerT = TypeVar("AnswerT", bound=Message)


class Ticket(Generic[AnswerT]):
    """A request under way. on_done is called once, when it is done."""

    def __init__(self, request: Request[AnswerT], retries: int) -> None:
        self.request = request
        self.payload = request.pack()
        if len(self.payload) > PAYLOAD_MAX:
            name = type(request).__name__
            raise FormatError(f"{name}: a payload of {len(self.payload)} bytes is longer than {PAYLOAD_MAX}")
        self.done = False
        self.on_done: Callable[[], None] | None = None
        self.retries = retries
        self.reference = 0
        self.sent_s = 0.0
        self._answer: AnswerT | None = None
        self._error: PdcpError | None = None

    def result(self) -> AnswerT:
        """The success answer; raises what went wrong instead."""
        assert self.done
        if self._error is not None:
            raise self._error
        assert self._answer is not None
        return self._answer

    def settle(self, answer: AnswerT | None, error: PdcpError | None = None) -> None:
        self.done = True
        self._answer, self._error = answer, error
        if self.on_done is not None:
            self.on_done()


class Session:
    """See above. Lets no exception out but those of submit."""

    def __init__(
        self,
        timeout_s: float = TIMEOUT_S,
        read_retries: int = READ_RETRIES,
        first_reference: int | None = None,
    ) -> None:
        """first_reference: random when not given, so that answers to a host before this one match nothing."""
        self.events: deque[events.Event] = deque()
        self.events_lost = 0  # nobody took those that waited
        self.strays = 0  # well-formed messages that answer nothing, or are no event
        self.receiver = Receiver()
        self._timeout_s = timeout_s
        self._read_retries = read_retries
        self._reference = (os.urandom(1)[0] if first_reference is None else first_reference - 1) % REFERENCES
        self._waiting: deque[Ticket[Any]] = deque()  # not sent yet
        self._under_way: list[Ticket[Any]] = []  # in the order in which they were sent
        self._progress_s = 0.0  # of the last answer
        self._output = bytearray()

    # --- requests ---

    def submit(self, request: Request[AnswerT], now_s: float) -> Ticket[AnswerT]:
        """Asks for something. Raises FormatError when a value does not fit the message."""
        ticket = Ticket(request, self._read_retries if request.READS else 0)
        self._waiting.append(ticket)
        self._send_waiting(now_s)
        return ticket

    def forget(self, ticket: Ticket[Any]) -> None:
        """Nobody wants the answer any more."""
        if ticket in self._waiting:
            self._waiting.remove(ticket)
        if ticket in self._under_way:
            self._under_way.remove(ticket)

    def fail_all(self, error: PdcpError) -> None:
        """The line is gone, and with it every request."""
        tickets = [*self._under_way, *self._waiting]
        self._under_way.clear()
        self._waiting.clear()
        for ticket in tickets:
            ticket.settle(None, error)

    def take_output(self) -> bytes:
        """Bytes to be sent."""
        output = bytes(self._output)
        self._output.clear()
        return output

    def _send_waiting(self, now_s: float) -> None:
        while self._waiting and self._has_room_for(self._waiting[0]):
            ticket = self._waiting.popleft()
            ticket.reference = self._next_reference()
            ticket.sent_s = now_s
            self._under_way.append(ticket)
            self._output += encode(ticket.request.ID, ticket.reference, ticket.payload)

    def _has_room_for(self, ticket: Ticket[Any]) -> bool:
        held = sum(len(each.payload) for each in self._under_way)
        return len(self._under_way) < HELD_MAX and held + len(ticket.payload) <= HELD_BYTES

    def _next_reference(self) -> int:
        # Four of them are in use at the most, so that one given up comes back after 250 others at the earliest.
        taken = {ticket.reference for ticket in self._under_way}
        while True:
            self._reference = self._reference % REFERENCES + 1
            if self._reference not in taken:
                return self._reference

    # --- answers ---

    def on_bytes(self, data: bytes, now_s: float) -> None:
        self._take(self.receiver.on_bytes(data, now_s), now_s)

    def on_time(self, now_s: float) -> None:
        """Gives up what has waited for too long; to be called at next_s at the latest."""
        self._take(self.receiver.on_time(now_s), now_s)
        late = [ticket for ticket in self._under_way if now_s >= self._deadline_s(ticket)]
        for ticket in late:
            self._give_up(ticket)
        self._send_waiting(now_s)

    @property
    def next_s(self) -> float | None:
        """When on_time has something to do; None: not before something else happens."""
        times = [self._deadline_s(ticket) for ticket in self._under_way]
        if self.receiver.next_s is not None:
            times.append(self.receiver.next_s)
        return min(times, default=None)

    def _deadline_s(self, ticket: Ticket[Any]) -> float:
        # While others are being served, a request waits for its turn.
        return max(ticket.sent_s, self._progress_s) + self._timeout_s

    def _give_up(self, ticket: Ticket[Any]) -> None:
        """No answer will come: once more, if that does no harm."""
        self._under_way.remove(ticket)
        if ticket.retries > 0:
            ticket.retries -= 1
            self._waiting.appendleft(ticket)
        else:
            ticket.settle(None, NoAnswerError(f"no answer from the arbitrator within {self._timeout_s:g} s"))

    def _take(self, frames: list[Frame], now_s: float) -> None:
        for frame in frames:
            if frame.reference == 0 and frame.message == EventMessage.ID:
                self._take_event(frame)
            else:
                self._take_answer(frame, now_s)
        self._send_waiting(now_s)

    def _take_event(self, frame: Frame) -> None:
        try:
            event = events.parse(EventMessage.unpack(frame.payload))
        except FormatError:
            self.strays += 1
            return
        if len(self.events) == EVENTS_MAX:
            self.events.popleft()
            self.events_lost += 1
        self.events.append(event)

    def _take_answer(self, frame: Frame, now_s: float) -> None:
        ticket = next((each for each in self._under_way if each.reference == frame.reference), None)
        if ticket is None:
            self.strays += 1
            return
        self._progress_s = now_s
        answer, error = _read(ticket.request, frame)
        if error is None or not _is_busy(error):
            # Only 'busy' overtakes; the others before this one were lost.
            for other in self._under_way[: self._under_way.index(ticket)]:
                self._give_up(other)
        self._under_way.remove(ticket)
        ticket.settle(answer, error)


def _is_busy(error: PdcpError) -> bool:
    return isinstance(error, RequestError) and error.code == ErrorCode.BUSY


def _read(request: Request[AnswerT], frame: Frame) -> tuple[AnswerT | None, PdcpError | None]:
    """The success answer in a frame, or what went wrong."""
    try:
        answer = unpack(frame)
    except FormatError as error:
        return None, BadAnswerError(f"a bad answer to {request.ID:04X}h: {error}")
    if isinstance(answer, request.success()):
        return answer, None
    if isinstance(answer, UnknownId):
        return None, UnknownMessageError(request.ID)
    if isinstance(answer, request.failure()):
        if isinstance(answer, Failure):
            return None, RequestError(request.ID, answer.error)
        if isinstance(answer, ResetFailure):
            return None, ResetError(request.ID, answer.results)
    return None, BadAnswerError(f"{request.ID:04X}h was answered by {frame.message:04X}h")
