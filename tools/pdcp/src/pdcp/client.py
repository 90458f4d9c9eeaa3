"""The client for scripts that do one thing after the other."""

import time
from collections.abc import Iterable, Iterator
from types import TracebackType
from typing import Self, TypeVar

from . import operations as op
from .errors import PdcpError
from .events import QUIET_KINDS, Event, EventKind
from .messages import Message, Request
from .model import (
    Action,
    ArbitratorInfo,
    Channel,
    ChannelId,
    Device,
    Flags,
    Identity,
    Link,
    LinkStatus,
    Stats,
    SystemInfo,
)
from .session import READ_RETRIES, TIMEOUT_S, Session
from .transport import BAUD, SerialTransport, Transport

T = TypeVar("T")
AnswerT = TypeVar("AnswerT", bound=Message)

IDLE_S = 3600.0  # one wait, when nothing is due


class Client:
    """An arbitrator at a serial port. For one thread.

    Everything raises errors.PdcpError: RequestError when the arbitrator says no, NoAnswerError when it says nothing,
    ConnectionFailedError when the port is gone.

        with Client("/dev/ttyUSB0") as arbitrator:
            for device in arbitrator.devices():
                print(device.identity, arbitrator.get_parameter(device.id, 7).decode())
    """

    def __init__(
        self,
        port: str | Transport,
        baud: int = BAUD,
        *,
        timeout_s: float = TIMEOUT_S,
        read_retries: int = READ_RETRIES,
    ) -> None:
        """timeout_s: for one answer; what only reads is asked for again read_retries times."""
        self._transport = SerialTransport(port, baud) if isinstance(port, str) else port
        self._session = Session(timeout_s, read_retries)

    def close(self) -> None:
        self._transport.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # --- one exchange ---

    def request(self, request: Request[AnswerT]) -> AnswerT:
        """Sends any message of messages.py and returns its success answer."""
        ticket = self._session.submit(request, time.monotonic())
        try:
            while not ticket.done:
                self._turn(None)
        finally:
            self._session.forget(ticket)  # an exception, such as Ctrl-C
        return ticket.result()

    def _turn(self, until_s: float | None) -> None:
        """Sends what is to be sent, then waits for bytes, or for the next time-out, at the longest until a time."""
        output = self._session.take_output()
        if output:
            self._transport.write(output)
        now_s = time.monotonic()
        times = [time_s for time_s in (self._session.next_s, until_s) if time_s is not None]
        data = self._transport.read(max(0.0, min(times, default=now_s + IDLE_S) - now_s))
        now_s = time.monotonic()
        self._session.on_bytes(data, now_s)
        self._session.on_time(now_s)

    def _run(self, operation: op.Operation[T]) -> T:
        try:
            request = next(operation)
            while True:
                try:
                    answer = self.request(request)
                except PdcpError as error:
                    request = operation.throw(error)
                else:
                    request = operation.send(answer)
        except StopIteration as end:
            result: T = end.value
            return result

    # --- tables ---

    def system_info(self) -> SystemInfo:
        return self._run(op.system_info())

    def device(self, number: int) -> Device:
        return self._run(op.device(number))

    def input(self, number: int) -> Channel:
        return self._run(op.input_channel(number))

    def output(self, number: int) -> Channel:
        return self._run(op.output_channel(number))

    def link_info(self, number: int) -> Link:
        return self._run(op.link_info(number))

    def devices(self) -> list[Device]:
        return self._run(op.table(op.device))

    def inputs(self) -> list[Channel]:
        return self._run(op.table(op.input_channel))

    def outputs(self) -> list[Channel]:
        return self._run(op.table(op.output_channel))

    def links(self) -> list[Link]:
        return self._run(op.table(op.link_info))

    # --- devices ---

    def get_parameter(self, target: ChannelId, parameter: int) -> bytes:
        """The raw value; parameters.py knows what it means."""
        return self._run(op.get_parameter(target, parameter))

    def set_parameter(self, target: ChannelId, parameter: int, value: bytes) -> None:
        self._run(op.set_parameter(target, parameter, value))

    def passthrough(self, identity: Identity, data: bytes) -> bytes:
        """Sends a frame of 1 to 8 bytes to a device and returns the data of its next answer."""
        return self._run(op.passthrough(identity, data))

    def suspend(self, identity: Identity | None = None, time_ms: int = 0) -> None:
        """One device, or all, send no channel data for a time; 0: until they are released."""
        self._run(op.suspend(identity, time_ms))

    def release(self, identity: Identity | None = None) -> None:
        self._run(op.release(identity))

    def reset(self, identity: Identity | None = None) -> None:
        """One device, or all. Raises ResetError, which names those that were not reset."""
        self._run(op.reset(identity))

    # --- links ---

    def link(self, output: ChannelId, input_: ChannelId) -> LinkStatus:
        """Makes this link, and replaces the input's source."""
        return self._run(op.link(output, input_))

    def unlink(self, input_: ChannelId) -> None:
        self._run(op.unlink(input_))

    # --- the arbitrator ---

    def info(self) -> ArbitratorInfo:
        return self._run(op.info())

    def set_flags(self, flags: Flags) -> None:
        self._run(op.set_flags(flags))

    def change_flags(self, on: Flags = Flags(0), off: Flags = Flags(0)) -> Flags:  # noqa: B008 - it is a constant
        """Switches some flags and leaves the others. Returns what they are now."""
        return self._run(op.change_flags(on, off))

    def action(self, which: Action, argument: int = 0) -> int:
        """Has the profile layer do something. Returns how many links were made or removed."""
        return self._run(op.action(which, argument))

    def read_configurations(self, progress: op.Progress | None = None) -> bytes:
        """The stored configurations, as a TLV string; progress(done, total) is called for each piece."""
        return self._run(op.read_configurations(progress))

    def write_configurations(self, data: bytes, progress: op.Progress | None = None) -> None:
        """Replaces all stored configurations, or none."""
        self._run(op.write_configurations(data, progress))

    def stats(self, group: int) -> Stats:
        return self._run(op.stats(group))

    def all_stats(self) -> list[Stats]:
        return self._run(op.all_stats())

    # --- events ---

    def stream(self, kinds: Iterable[EventKind] = QUIET_KINDS) -> None:
        """From now on the arbitrator tells these kinds of events; none: it tells nothing any more."""
        self._run(op.stream(kinds))

    def events(self, timeout_s: float | None = None) -> Iterator[Event]:
        """Events as they come, those first that came before; ends when none has come for timeout_s."""
        last_s = time.monotonic()
        while True:
            if self._session.events:
                yield self._session.events.popleft()
                last_s = time.monotonic()
                continue
            if timeout_s is not None and time.monotonic() >= last_s + timeout_s:
                return
            self._turn(None if timeout_s is None else last_s + timeout_s)
