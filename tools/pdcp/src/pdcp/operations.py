"""What can be asked of an arbitrator, written once for both clients.

An operation is a generator: it yields requests, is sent their success answers, or has what went wrong thrown into it,
and returns its result. Whoever drives it decides how to wait.
"""

from collections.abc import Callable, Generator, Iterable
from typing import Any, TypeVar

from . import messages as m
from .counters import name_counters
from .errors import BadAnswerError, ErrorCode, RequestError, ResetError
from .events import EventKind
from .model import (
    BROADCAST,
    UINT16_MAX,
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
    Stats,
    SystemInfo,
)
from .protocol import FunctionCode, Response

PIECE = 128  # bytes of stored configurations in one message (240Ah)
CAN_DATA_MAX = 8
NUMBERS = range(1, 256)

T = TypeVar("T")
AnswerT = TypeVar("AnswerT", bound=m.Message)
Operation = Generator[m.Request[Any], Any, T]
Progress = Callable[[int, int], None]  # done, of


def ask(request: m.Request[AnswerT]) -> Operation[AnswerT]:
    """The operation of one request."""
    answer: AnswerT = yield request
    return answer


# --- tables ---


def system_info() -> Operation[SystemInfo]:
    answer = yield from ask(m.GetSystemInfo())
    return SystemInfo(answer.devices, answer.inputs, answer.outputs, answer.links)


def device(number: int) -> Operation[Device]:
    answer = yield from ask(m.GetDeviceInfo(number))
    return Device(number, answer.channel.identity, answer.type, answer.profile)


def input_channel(number: int) -> Operation[Channel]:
    answer = yield from ask(m.GetInputInfo(number))
    return Channel(number, Direction.INPUT, answer.channel, answer.type, answer.profile)


def output_channel(number: int) -> Operation[Channel]:
    answer = yield from ask(m.GetOutputInfo(number))
    return Channel(number, Direction.OUTPUT, answer.channel, answer.type, answer.profile)


def link_info(number: int) -> Operation[Link]:
    answer = yield from ask(m.GetLinkInfo(number))
    return Link(number, answer.output, answer.input, _link_status(answer.status))


def table(row: Callable[[int], Operation[T]]) -> Operation[list[T]]:
    """Entry after entry, until the arbitrator says that the number is out of range."""
    rows = []
    for number in NUMBERS:
        try:
            rows.append((yield from row(number)))
        except RequestError as error:
            if error.code != ErrorCode.OUT_OF_RANGE:
                raise
            break
    return rows


def _link_status(status: int) -> LinkStatus:
    try:
        return LinkStatus(status)
    except ValueError:
        raise BadAnswerError(f"there is no link status {status}") from None


# --- devices ---


def get_parameter(target: ChannelId, parameter: int) -> Operation[bytes]:
    answer = yield from ask(m.GetParameter(target, parameter))
    return answer.value


def set_parameter(target: ChannelId, parameter: int, value: bytes) -> Operation[None]:
    yield from ask(m.SetParameter(target, parameter, value))


def passthrough(identity: Identity, data: bytes) -> Operation[bytes]:
    answer = yield from ask(m.Passthrough(identity, len(data), data.ljust(CAN_DATA_MAX, b"\0")))
    if answer.dlc > CAN_DATA_MAX:
        raise BadAnswerError(f"a frame cannot have {answer.dlc} bytes")
    return answer.data[: answer.dlc]


def _command(identity: Identity | None, data: bytes) -> Operation[None]:
    """Suspend or release, whose answer says after its function code whether the device did it."""
    answer = yield from passthrough(identity or BROADCAST, data)
    # An answer too short to hold its response code means success (D-BUS-18).
    if identity is not None and len(answer) > 1 and answer[1] != Response.SUCCESS:
        raise RequestError(m.Passthrough.ID, ErrorCode.DEVICE_REFUSED)


def suspend(identity: Identity | None, time_ms: int) -> Operation[None]:
    if not 0 <= time_ms <= UINT16_MAX:
        raise m.FormatError(f"a device cannot be suspended for {time_ms} ms, only for 0 to {UINT16_MAX}")
    return _command(identity, bytes([FunctionCode.SUSPEND]) + time_ms.to_bytes(2, "little"))


def release(identity: Identity | None) -> Operation[None]:
    return _command(identity, bytes([FunctionCode.RELEASE]))


def reset(identity: Identity | None) -> Operation[None]:
    devices = yield from table(device)
    asked = [each for each in devices if identity in (None, each.identity)]
    if not asked and identity is not None:
        raise RequestError(m.Reset.ID, ErrorCode.UNKNOWN_DEVICE)
    try:
        yield from ask(m.Reset(0 if identity is None else asked[0].number))
    except ResetError as error:
        missed = [each.identity for each in asked if not error.was_reset(each.number)]
        raise ResetError(error.message, error.results, missed) from None


# --- links ---


def link(output: ChannelId, input_: ChannelId) -> Operation[LinkStatus]:
    answer = yield from ask(m.ConfigureLink(output, input_))
    return _link_status(answer.status)


def unlink(input_: ChannelId) -> Operation[None]:
    yield from ask(m.RemoveLink(input_))


# --- the arbitrator ---


def info() -> Operation[ArbitratorInfo]:
    answer = yield from ask(m.GetArbitratorInfo())
    try:
        state = ProfileState(answer.profile_state)
    except ValueError:
        raise BadAnswerError(f"there is no profile state {answer.profile_state}") from None
    return ArbitratorInfo(
        answer.protocol,
        (answer.firmware_major, answer.firmware_minor, answer.firmware_patch),
        Limits(answer.devices_max, answer.channels_max, answer.links_max),
        state,
        answer.active,
        answer.stored,
        Flags(answer.flags),
    )


def set_flags(flags: Flags) -> Operation[None]:
    yield from ask(m.SetFlags(int(flags)))


def change_flags(on: Flags, off: Flags) -> Operation[Flags]:
    """Switches some flags and leaves the others. Returns what they are now."""
    found = yield from info()
    flags = (found.flags | on) & ~off & ~Flags.EVENT_STREAM
    yield from set_flags(flags)
    return flags | found.flags & Flags.EVENT_STREAM


def action(which: Action, argument: int = 0) -> Operation[int]:
    answer = yield from ask(m.ProfileAction(which, argument))
    return answer.result


def read_configurations(progress: Progress | None) -> Operation[bytes]:
    data = bytearray()
    while True:
        piece = yield from ask(m.ReadConfigurations(len(data), PIECE))
        if piece.offset != len(data) or len(data) + len(piece.data) > piece.total:
            raise BadAnswerError(f"a piece of stored configurations at {piece.offset} instead of {len(data)}")
        data += piece.data
        if progress is not None:
            progress(len(data), piece.total)
        if len(data) == piece.total:
            return bytes(data)
        if not piece.data:
            raise BadAnswerError(f"stored configurations end after {len(data)} of {piece.total} bytes")


def write_configurations(data: bytes, progress: Progress | None) -> Operation[None]:
    if not data:
        raise ValueError("there is nothing to write")
    for at in range(0, len(data), PIECE):
        piece = data[at : at + PIECE]
        yield from ask(m.WriteConfigurations(at, len(data), piece))
        if progress is not None:
            progress(at + len(piece), len(data))


def stats(group: int) -> Operation[Stats]:
    answer = yield from ask(m.GetStatistics(group))
    if answer.group != group:
        raise BadAnswerError(f"counters of group {answer.group} instead of {group}")
    return name_counters(group, answer.counters)


def all_stats() -> Operation[list[Stats]]:
    """Group after group, until there are no more."""
    groups = []
    for group in range(256):
        try:
            groups.append((yield from stats(group)))
        except RequestError as error:
            if error.code != ErrorCode.OUT_OF_RANGE:
                raise
            break
    return groups


def stream(kinds: Iterable[EventKind]) -> Operation[None]:
    mask = 0
    for kind in kinds:
        mask |= kind.mask
    yield from ask(m.StreamEvents(mask))
