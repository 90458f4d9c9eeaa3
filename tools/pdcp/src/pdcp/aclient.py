"""The client for programs on asyncio. Any number of tasks may use one; their requests share the line."""

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Iterable
from types import TracebackType
from typing import Self, TypeVar

from . import operations as op
from .errors import ConnectionFailedError, PdcpError
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
from .transport import BAUD, SLICE_S, SerialTransport, Transport

T = TypeVar("T")
AnswerT = TypeVar("AnswerT", bound=Message)


class AsyncClient:
    """Like client.Client, whose documentation counts here too.

        async with AsyncClient("/dev/ttyUSB0") as arbitrator:
            print(await arbitrator.system_info())

    A thread of its own waits for bytes, which is the one way that works for every kind of port on every system;
    everything else happens in the event loop.
    """

    def __init__(
        self,
        port: str | Transport,
        baud: int = BAUD,
        *,
        timeout_s: float = TIMEOUT_S,
        read_retries: int = READ_RETRIES,
    ) -> None:
        self._port = port
        self._baud = baud
        self._session = Session(timeout_s, read_retries)
        self._transport: Transport | None = None
        self._reader: threading.Thread | None = None
        self._ends = threading.Event()
        self._timer: asyncio.TimerHandle | None = None
        self._lost: ConnectionFailedError | None = None
        self._changed = asyncio.Event()  # an event came, or the line is gone

    async def open(self) -> None:
        """Opens the port. Raises ConnectionFailedError."""
        loop = asyncio.get_running_loop()
        transport = SerialTransport(self._port, self._baud) if isinstance(self._port, str) else self._port
        self._transport = transport
        self._reader = threading.Thread(target=self._read, args=(loop, transport), name="pdcp", daemon=True)
        self._reader.start()

    async def close(self) -> None:
        self._ends.set()
        if self._reader is not None:
            await asyncio.to_thread(self._reader.join)
            self._reader = None
        if self._transport is not None:
            self._transport.close()
            self._transport = None
        self._on_lost(ConnectionFailedError("the client is closed"))

    async def __aenter__(self) -> Self:
        await self.open()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    # --- one exchange ---

    async def request(self, request: Request[AnswerT]) -> AnswerT:
        if self._lost is not None:
            raise self._lost
        if self._transport is None:
            raise ConnectionFailedError("the client is not open")
        ticket = self._session.submit(request, time.monotonic())
        done = asyncio.get_running_loop().create_future()
        ticket.on_done = lambda: None if done.done() else done.set_result(None)
        self._turn()
        try:
            await done
        finally:
            self._session.forget(ticket)  # cancelled
        return ticket.result()

    def _turn(self) -> None:
        """Sends what is to be sent and sets the timer to the next time-out."""
        output = self._session.take_output()
        if output and self._transport is not None:
            try:
                self._transport.write(output)
            except ConnectionFailedError as error:
                self._on_lost(error)
        if self._session.events:
            self._changed.set()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._session.next_s is not None:
            delay_s = max(0.0, self._session.next_s - time.monotonic())
            self._timer = asyncio.get_running_loop().call_later(delay_s, self._on_time)

    def _on_time(self) -> None:
        self._session.on_time(time.monotonic())
        self._turn()

    def _on_bytes(self, data: bytes) -> None:
        now_s = time.monotonic()
        self._session.on_bytes(data, now_s)
        self._session.on_time(now_s)
        self._turn()

    def _on_lost(self, error: ConnectionFailedError) -> None:
        self._lost = self._lost or error
        self._session.fail_all(error)
        self._changed.set()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _read(self, loop: asyncio.AbstractEventLoop, transport: Transport) -> None:
        """The thread."""
        try:
            while not self._ends.is_set():
                data = transport.read(SLICE_S)
                if data:
                    loop.call_soon_threadsafe(self._on_bytes, data)
        except ConnectionFailedError as error:
            if not self._ends.is_set():
                loop.call_soon_threadsafe(self._on_lost, error)
        except RuntimeError:
            pass  # the loop has been closed

    async def _run(self, operation: op.Operation[T]) -> T:
        try:
            request = next(operation)
            while True:
                try:
                    answer = await self.request(request)
                except PdcpError as error:
                    request = operation.throw(error)
                else:
                    request = operation.send(answer)
        except StopIteration as end:
            result: T = end.value
            return result

    # --- tables ---

    async def system_info(self) -> SystemInfo:
        return await self._run(op.system_info())

    async def device(self, number: int) -> Device:
        return await self._run(op.device(number))

    async def input(self, number: int) -> Channel:
        return await self._run(op.input_channel(number))

    async def output(self, number: int) -> Channel:
        return await self._run(op.output_channel(number))

    async def link_info(self, number: int) -> Link:
        return await self._run(op.link_info(number))

    async def devices(self) -> list[Device]:
        return await self._run(op.table(op.device))

    async def inputs(self) -> list[Channel]:
        return await self._run(op.table(op.input_channel))

    async def outputs(self) -> list[Channel]:
        return await self._run(op.table(op.output_channel))

    async def links(self) -> list[Link]:
        return await self._run(op.table(op.link_info))

    # --- devices ---

    async def get_parameter(self, target: ChannelId, parameter: int) -> bytes:
        return await self._run(op.get_parameter(target, parameter))

    async def set_parameter(self, target: ChannelId, parameter: int, value: bytes) -> None:
        await self._run(op.set_parameter(target, parameter, value))

    async def passthrough(self, identity: Identity, data: bytes) -> bytes:
        return await self._run(op.passthrough(identity, data))

    async def suspend(self, identity: Identity | None = None, time_ms: int = 0) -> None:
        await self._run(op.suspend(identity, time_ms))

    async def release(self, identity: Identity | None = None) -> None:
        await self._run(op.release(identity))

    async def reset(self, identity: Identity | None = None) -> None:
        await self._run(op.reset(identity))

    # --- links ---

    async def link(self, output: ChannelId, input_: ChannelId) -> LinkStatus:
        return await self._run(op.link(output, input_))

    async def unlink(self, input_: ChannelId) -> None:
        await self._run(op.unlink(input_))

    # --- the arbitrator ---

    async def info(self) -> ArbitratorInfo:
        return await self._run(op.info())

    async def set_flags(self, flags: Flags) -> None:
        await self._run(op.set_flags(flags))

    async def change_flags(self, on: Flags = Flags(0), off: Flags = Flags(0)) -> Flags:  # noqa: B008 - it is a constant
        return await self._run(op.change_flags(on, off))

    async def action(self, which: Action, argument: int = 0) -> int:
        return await self._run(op.action(which, argument))

    async def read_configurations(self, progress: op.Progress | None = None) -> bytes:
        return await self._run(op.read_configurations(progress))

    async def write_configurations(self, data: bytes, progress: op.Progress | None = None) -> None:
        await self._run(op.write_configurations(data, progress))

    async def stats(self, group: int) -> Stats:
        return await self._run(op.stats(group))

    async def all_stats(self) -> list[Stats]:
        return await self._run(op.all_stats())

    # --- events ---

    async def stream(self, kinds: Iterable[EventKind] = QUIET_KINDS) -> None:
        await self._run(op.stream(kinds))

    async def events(self, timeout_s: float | None = None) -> AsyncIterator[Event]:
        """Events as they come, those first that came before; ends when none has come for timeout_s."""
        while True:
            if self._session.events:
                yield self._session.events.popleft()
                continue
            if self._lost is not None:
                raise self._lost
            self._changed.clear()
            try:
                await asyncio.wait_for(self._changed.wait(), timeout_s)
            except TimeoutError:
                return
