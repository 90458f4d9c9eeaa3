"""What frames on a PDCP bus say (pdcp-bus.md), every field by its name.

A Decoder learns from the traffic: who has which node id (bind answers), which way a channel goes and what it
carries (its parameters), which id an output sends from. What it has not seen it does not guess: such values stay
raw.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TypeAlias

from .frames import Frame
from .functions import FUNCTIONS, Function, Values, code_class, sizes_text, split, word_at
from .model import ChannelId, Identity
from .parameters import (
    TRANSFER_KINDS,
    TRANSFER_TYPE,
    Form,
    Kind,
    Parameter,
    Style,
    by_number,
    channels_of,
    show_profile,
)
from .profiles import channel_value
from .protocol import NO_CHANNEL, NODE_MAX, TEXTS, FunctionCode, Response

__all__ = ["Decoded", "Decoder", "Field", "format_line", "to_json"]

_BINDING = 3
_UNUSED_NODE = 255
_PARAMETER_RESPONSES = TEXTS["response"]
_RESPONSES = {number: text for number, text in _PARAMETER_RESPONSES.items() if number != Response.USE_BULK}
_OTHER_KINDS = {"extended": "Extended Frame", "remote": "Remote Frame", "error": "Error Frame", "fd": "CAN FD Frame"}
_BROADCASTS = (FunctionCode.SUSPEND, FunctionCode.RELEASE, FunctionCode.BEACON, FunctionCode.RESET)
_ANSWERED = (0x03, 0x04, 0x08, 0x09, 0x0B, 0x0C, 0x0D, 0x0F)

# Parameters of channels that the decoder learns from.
_TYPE, _SOURCE_CHANNEL, _SOURCE_NODES = 1, 6, 7
_NODE_ID = 5  # of an output; of an input it is the source's device
_ONLY_INPUTS = (6, 7, 8, 11)

Json: TypeAlias = "bool | int | str | list[int] | None"


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a frame: its value for machines, and as people read it."""

    name: str
    value: Json
    text: str


@dataclass(slots=True)
class Decoded:
    """One frame, decoded. `code` is -1 when the data has no function code. `problem` says why a frame is malformed
    or out of place; arbitrators ignore such frames."""

    frame: Frame
    meaning: str
    route: str = ""
    code: int = -1
    fields: list[Field] = field(default_factory=list)
    problem: str = ""
    notes: list[str] = field(default_factory=list)
    device: Identity | None = None  # that sends or is addressed, if it is known

    @property
    def priority(self) -> int:
        return self.frame.can_id >> 9 & 3

    @property
    def from_arbitrator(self) -> bool:
        return bool(self.frame.can_id & 0x100)

    @property
    def node(self) -> int:
        return self.frame.can_id & 0xFF


# --- fields ---------------------------------------------------------------------------------------


def _node_text(node: int) -> str:
    return f"{node:02X}h"


def _count_text(size: int) -> str:
    return f"{size} byte" if size == 1 else f"{size} bytes"


def _raw_field(name: str, data: bytes) -> Field:
    return Field(name, data.hex().upper(), data.hex().upper() or "(empty)")


def _parameter_of(channel: int, number: int, kind: Kind | None) -> Parameter | None:
    """None: the specification has none, or which one it is depends on the channel's kind, which is not known."""
    if channel == 0:
        return by_number(Kind.DEVICE, number)
    if kind is None and number == _NODE_ID:
        return None
    return by_number(kind or Kind.INPUT, number)  # all others are the same of both, or an input's alone


def _text_field(name: str, data: bytes) -> Field:
    """In quotes, without control characters."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        return Field(name, None, f"{data.hex().upper()} (no UTF-8)")
    return Field(name, text, json.dumps(text, ensure_ascii=not text.isprintable()))


def _value_fields(parameter: Parameter | None, data: bytes) -> list[Field]:
    """The fields of a value, each with the name that it has in `get`; bytes that are missing or too many are told."""
    if parameter is None:
        return [_raw_field("value", data)]
    if parameter.form is Form.TEXT:
        return [_text_field(parameter.name, data)]
    if parameter.form is Form.CHANNELS:
        return [Field(parameter.name, channels_of(data), parameter.show(data))]
    fields = []
    for part, number in zip(parameter.fields, parameter.numbers(data), strict=True):
        text = _node_text(number) if part.style is Style.NODE else part.show(number)
        fields.append(Field(part.name, part.decode(number), "none" if parameter.is_no_source(data) else text))
    size = parameter.size or 0
    if len(data) < size:
        fields.append(Field("bytes_missing", size - len(data), str(size - len(data))))
    if len(data) > size:
        fields.append(_raw_field("bytes_extra", data[size:]))
    return fields


# --- what is known --------------------------------------------------------------------------------


@dataclass(slots=True)
class _Channel:
    kind: Kind | None = None  # input or output
    type: int = -1
    profile: int = 0
    source_channel: int = 0


@dataclass(slots=True)
class _Transfer:
    """A bulk transfer from its configure frame on."""

    parameter: int
    channel: int
    to_device: bool
    size: int = -1  # -1: not agreed on yet
    data: bytearray = field(default_factory=bytearray)
    packet: int = 0  # the next one
    waiting: bytes | None = None  # sent, not acknowledged


@dataclass(slots=True)
class _Device:
    identity: Identity | None = None
    vid_pid: tuple[int, int] | None = None
    channels: dict[int, _Channel] = field(default_factory=dict)
    written: dict[tuple[int, int], bytes] = field(default_factory=dict)  # channel, parameter: not answered yet
    asked: set[tuple[int, int, int]] = field(default_factory=set)  # code, parameter, channel: not answered yet
    transfer: _Transfer | None = None

    def channel(self, index: int) -> _Channel:
        return self.channels.setdefault(index, _Channel())

    def kind(self, index: int) -> Kind | None:
        known = self.channels.get(index)
        return known.kind if known else None


@dataclass(frozen=True, slots=True)
class _Output:
    node: int  # of its device
    index: int  # 0: not known


class Decoder:
    """Decodes frames one after the other, in the order of the bus. Any frame will do; nothing raises."""

    def __init__(self) -> None:
        self._devices: dict[int, _Device] = {}
        self._outputs: dict[int, _Output] = {}

    # --- for others ---

    def sender(self, frame: Frame) -> str:
        """Who sent a frame, as far as is known by now: `arbitrator`, `2:2:4`, `2:2:4.1` for its channel, `node 11h`,
        or `other frames` for what PDCP does not use."""
        if not frame.is_base:
            return "other frames"
        if frame.can_id & 0x100:
            return "arbitrator"
        node = frame.can_id & 0xFF
        if frame.can_id >> 9 == _BINDING:
            is_request = frame.data[:1] == b"\x01" and len(frame.data) in FUNCTIONS[0x01].sizes
            return str(_identity(split(FUNCTIONS[0x01], frame.data))) if is_request else f"node {_node_text(node)}"
        output = self._outputs.get(node)
        return self._device_text(node) if output is None else self._output_text(node, output)

    def decode(self, frame: Frame) -> Decoded:
        """What a frame says. Learns from it."""
        if not frame.is_base:
            decoded = Decoded(frame, _OTHER_KINDS[frame.kind], problem="PDCP uses base data frames alone")
            decoded.fields = [_raw_field("data", frame.data)]
            return decoded
        decoded = Decoded(frame, "")
        node = decoded.node
        decoded.route = self._route(decoded)
        decoded.device = self._identity_of(node)
        if decoded.priority == _BINDING:
            self._binding(decoded)
        elif decoded.from_arbitrator:
            self._message(decoded)
        elif node in self._outputs:
            self._channel_data(decoded)
        elif node in self._devices:
            self._message(decoded)
        else:
            self._stranger(decoded)
        return decoded

    # --- sorts of frames ---

    def _route(self, decoded: Decoded) -> str:
        node = _node_text(decoded.node)
        if decoded.from_arbitrator:
            return f"BA > {node if decoded.node else 'all'}"
        return f"{node} > *" if decoded.node in self._outputs and decoded.priority != _BINDING else f"{node} > BA"

    def _identity_of(self, node: int) -> Identity | None:
        device = self._devices.get(node)
        return device.identity if device else None

    def _device_text(self, node: int) -> str:
        return str(self._identity_of(node) or f"node {_node_text(node)}")

    def _binding(self, decoded: Decoded) -> None:
        """Priority 3: bind requests alone."""
        frame = decoded.frame
        if decoded.from_arbitrator:
            decoded.meaning, decoded.problem = "Binding Frame", "priority 3 with mode 1 is not used"
            decoded.fields = [_raw_field("data", frame.data)]
        elif frame.data[:1] != b"\x01":
            decoded.meaning, decoded.problem = "Binding Frame", "priority 3 is for Bind Device Request alone"
            decoded.fields = [_raw_field("data", frame.data)]
        else:
            self._message(decoded)
            decoded.fields.insert(0, Field("requested", decoded.node, _node_text(decoded.node)))
            if not decoded.problem:
                decoded.device = _identity(split(FUNCTIONS[0x01], frame.data))

    def _stranger(self, decoded: Decoded) -> None:
        """An id that nothing is known of: a message if it can be one, else perhaps channel data."""
        code = decoded.frame.data[0] if decoded.frame.data else -1
        function = FUNCTIONS.get(code)
        if function is not None and function.device and len(decoded.frame.data) in function.sizes:
            self._message(decoded)
        else:
            decoded.meaning = "Channel Data or unknown"
            decoded.fields = [_raw_field("data", decoded.frame.data)]
        if decoded.node not in (0, _UNUSED_NODE):
            decoded.notes.append("unknown id")
        else:
            self._check_place(decoded)

    def _channel_data(self, decoded: Decoded) -> None:
        node, data = decoded.node, decoded.frame.data
        output = self._outputs[node]
        device = self._devices.get(output.node)
        channel = device.channels.get(output.index) if device else None
        decoded.meaning = "Channel Data"
        decoded.device = device.identity if device else None
        text = self._output_text(node, output)
        decoded.fields = [Field("output", text, text)]
        if channel is not None and channel.type >= 0:
            decoded.fields.append(Field("profile", channel.profile, show_profile(channel.profile)))
            value = channel_value(channel.type, data)
            if value is not None:
                decoded.fields.append(Field("value", value, str(value).lower()))
        decoded.fields.append(_raw_field("data", decoded.frame.data))

    def _output_text(self, node: int, output: _Output) -> str:
        identity = self._identity_of(output.node)
        if identity and output.index:
            return str(ChannelId(identity, output.index))
        which = f"channel {output.index}" if output.index else f"output {_node_text(node)}"
        return f"{self._device_text(output.node)} {which}"

    # --- messages ---

    def _message(self, decoded: Decoded) -> None:
        data = decoded.frame.data
        if not data:
            decoded.meaning, decoded.problem = "Empty Frame", "there is no function code"
            return
        decoded.code = data[0]
        function = FUNCTIONS.get(data[0])
        if function is None:
            name = code_class(data[0])
            decoded.meaning = f"{name} {data[0]:02X}h"
            if name == "Unknown Code":
                decoded.problem = "the protocol has no such code"
            decoded.fields = [_raw_field("rest", data[1:])]
            self._check_place(decoded)
            return
        decoded.meaning = function.name
        if len(data) not in function.sizes:
            decoded.problem = f"must have {sizes_text(function.sizes)}, has {len(data)}"
            decoded.fields = [_raw_field("rest", data[1:])]
            return
        self._fields(decoded, function)
        self._check_place(decoded)
        if not decoded.problem:
            self._follow(decoded)

    def _fields(self, decoded: Decoded, function: Function) -> None:
        values = split(function, decoded.frame.data)
        if function.deprecated:
            decoded.notes.append("deprecated")
        if "response" in dict(function.layout):
            decoded.fields.append(self._response(decoded, values))
        for name in ("node", "time", "packet"):
            if name in values:
                decoded.fields.append(_plain_field(decoded, name, values[name]))
        if "vid" in values:
            identity = str(_identity(values))
            decoded.fields.append(Field("identity", identity, identity))
        self._parameter_fields(decoded, values)
        if "size" in values:
            decoded.fields.append(Field("size", values["size"], _count_text(values["size"])))
        name, size = function.layout[-1] if function.layout else ("", 1)
        if size == 0 and name != "value":
            decoded.fields.append(_raw_field(name, values.tail))

    def _response(self, decoded: Decoded, values: Values) -> Field:
        if "response" not in values:
            return Field("response", int(Response.SUCCESS), "success (not said, D-BUS-18)")
        number = values["response"]
        names = _PARAMETER_RESPONSES if decoded.code in (0x83, 0x84) else _RESPONSES
        return Field("response", number, names.get(number, f"{number} (not defined)"))

    def _parameter_fields(self, decoded: Decoded, values: Values) -> None:
        if "channel" not in values:
            return
        channel = values["channel"]
        kind = self._kind(decoded, values)
        if "parameter" not in values:
            decoded.fields.append(_channel_field(channel, kind))
            return
        number = values["parameter"]
        decoded.fields += _place_fields(channel, number, kind)
        if values.tail or (decoded.code == 0x83 and values["response"] == Response.SUCCESS):
            decoded.fields += _value_fields(_parameter_of(channel, number, kind), values.tail)

    def _kind(self, decoded: Decoded, values: Values) -> Kind | None:
        """What a channel is: as its transfer type said, or as what is written to it tells."""
        channel = values["channel"]
        if channel == 0:
            return None
        device = self._devices.get(decoded.node)
        known = device.kind(channel) if device else None
        number, size = values.get("parameter"), len(values.tail)
        if known:
            return known
        if decoded.code in (0x0F, 0x8F) or number in _ONLY_INPUTS:
            return Kind.INPUT
        if number == _NODE_ID and size:
            return Kind.OUTPUT if size == 1 else Kind.INPUT
        return None

    def _check_place(self, decoded: Decoded) -> None:
        """A sound message from who must not send it, or to whom it must not go."""
        function = FUNCTIONS.get(decoded.code)
        if decoded.problem:
            return
        if not decoded.from_arbitrator and decoded.priority != _BINDING and decoded.node in (0, _UNUSED_NODE):
            decoded.problem = f"no device has the id {_node_text(decoded.node)}"
        elif function is None:
            return
        elif decoded.from_arbitrator and not function.arbitrator:
            decoded.problem = "only a device sends this"
        elif not decoded.from_arbitrator and not function.device:
            decoded.problem = "only the arbitrator sends this"
        elif decoded.code == 0x01 and decoded.priority != _BINDING:
            decoded.problem = "a bind request has priority 3"
        elif decoded.from_arbitrator and decoded.node == 0 and decoded.code not in (*_BROADCASTS, 0x81):
            decoded.problem = "this is not sent to all"
        elif decoded.from_arbitrator and decoded.node and decoded.code == FunctionCode.BEACON:
            decoded.problem = "an arbitrator beacons to all"

    # --- learning ---

    def _follow(self, decoded: Decoded) -> None:
        """What the next frames mean depends on this one."""
        code, node = decoded.code, decoded.node
        values = split(FUNCTIONS[code], decoded.frame.data)
        if code == 0x81:
            self._bound(decoded, values)
            return
        if code == 0x01 or node == 0:
            return
        if decoded.from_arbitrator:
            self._address(node)
        device = self._devices.get(node)
        if device is None:
            return
        self._pair(decoded, device, values)
        if code == 0x04:
            device.written[values["channel"], values["parameter"]] = values.tail
        elif code in (0x83, 0x84):
            self._answered(decoded, device, values)
        elif code in (0x0C, 0x0D):
            to_device = code == 0x0D
            device.transfer = _Transfer(values["parameter"], values["channel"], to_device)
        elif code in (0x8C, 0x8D):
            self._configured(decoded, device, values)
        elif code == 0x0E:
            self._packet(decoded, device, values)
        elif code == 0x8E:
            self._acknowledged(decoded, device, values)

    @staticmethod
    def _pair(decoded: Decoded, device: _Device, values: Values) -> None:
        """Says of an answer that nobody asked for it."""
        key = (decoded.code & 0x7F, values.get("parameter", 0), values.get("channel", 0))
        if key[0] not in _ANSWERED:
            return
        if decoded.code < 0x80:
            device.asked.add(key)
        elif key in device.asked:
            device.asked.remove(key)
        else:
            decoded.notes.append("nobody asked")

    def _address(self, node: int) -> None:
        """Whom the arbitrator talks to is a device, not an output."""
        self._outputs.pop(node, None)
        self._devices.setdefault(node, _Device())

    def _bound(self, decoded: Decoded, values: Values) -> None:
        requested, granted = decoded.node, values["node"]
        identity = _identity(values)
        decoded.device = identity
        if granted != requested or not 1 <= granted <= NODE_MAX:
            return
        device = self._devices.get(granted)
        if device is None or device.identity != identity:
            self._forget(granted)
            device = next((known for known in self._devices.values() if known.identity == identity), _Device(identity))
            for node in [node for node, known in self._devices.items() if known is device]:
                self._forget(node)
        self._outputs.pop(granted, None)
        self._devices[granted] = device

    def _forget(self, node: int) -> None:
        self._devices.pop(node, None)
        self._outputs = {key: output for key, output in self._outputs.items() if output.node != node}

    def _answered(self, decoded: Decoded, device: _Device, values: Values) -> None:
        channel, parameter = values["channel"], values["parameter"]
        written = device.written.pop((channel, parameter), b"") if decoded.code == 0x84 else b""
        if values.get("response") == Response.SUCCESS:
            self._learn(decoded.node, device, channel, parameter, values.tail or written)

    def _learn(self, node: int, device: _Device, channel: int, parameter: int, value: bytes) -> None:
        """A parameter has this value."""
        if channel == 0:
            _learn_identity(device, parameter, value)
            return
        known = device.channel(channel)
        if parameter == TRANSFER_TYPE and word_at(value, 0, 1) in TRANSFER_KINDS:
            known.kind = TRANSFER_KINDS[word_at(value, 0, 1)]
        elif parameter == _TYPE:
            known.type, known.profile = word_at(value), word_at(value, 2)
        elif parameter == _NODE_ID and (known.kind is Kind.OUTPUT or (known.kind is None and len(value) == 1)):
            known.kind = Kind.OUTPUT
            self._output_node(word_at(value, 0, 1), _Output(node, channel))
        elif parameter in _ONLY_INPUTS and known.kind is not Kind.OUTPUT:
            known.kind = Kind.INPUT
            self._learn_source(known, parameter, value)

    def _learn_source(self, known: _Channel, parameter: int, value: bytes) -> None:
        """What an input hears tells of the output that it hears, too."""
        if parameter == _SOURCE_CHANNEL:
            known.source_channel = 0 if word_at(value, 2, 1) == NO_CHANNEL else word_at(value, 2, 1)
        elif parameter == _SOURCE_NODES and word_at(value, 1, 1) and word_at(value, 1, 1) not in self._outputs:
            self._output_node(word_at(value, 1, 1), _Output(word_at(value, 0, 1), known.source_channel))

    def _output_node(self, node: int, output: _Output) -> None:
        if 1 <= node <= NODE_MAX and node != output.node:
            for old in [key for key, other in self._outputs.items() if other == output and output.index]:
                del self._outputs[old]
            self._outputs[node] = output
            self._devices.pop(node, None)

    # --- bulk transfer ---

    def _configured(self, decoded: Decoded, device: _Device, values: Values) -> None:
        transfer = device.transfer
        asked = (values["parameter"], values["channel"], decoded.code == 0x8D)
        if transfer is None or asked != (transfer.parameter, transfer.channel, transfer.to_device):
            return
        if values["response"] != Response.SUCCESS:
            device.transfer = None
        else:
            transfer.size = values["size"]
            if transfer.size == 0:
                self._complete(decoded, device, transfer)

    def _packet(self, decoded: Decoded, device: _Device, values: Values) -> None:
        transfer = device.transfer
        if transfer is None or transfer.size < 0 or transfer.to_device != decoded.from_arbitrator:
            decoded.notes.append("no transfer is known")
            return
        packet, data = values["packet"], values.tail
        if packet == transfer.packet:
            if transfer.waiting is not None:
                decoded.notes.append("repeated")
            transfer.waiting = data
            begin, end = len(transfer.data), len(transfer.data) + len(data)
            decoded.fields.append(Field("offset", begin, f"{begin} of {_count_text(transfer.size)}"))
            if end > transfer.size:
                decoded.notes.append(f"{_count_text(end - transfer.size)} too many")
        elif packet == transfer.packet - 1 & 0xFF and transfer.data:
            decoded.notes.append("repeated")
        else:
            decoded.notes.append(f"packet {transfer.packet} was expected")

    def _acknowledged(self, decoded: Decoded, device: _Device, values: Values) -> None:
        transfer = device.transfer
        if transfer is None or transfer.size < 0 or transfer.to_device == decoded.from_arbitrator:
            decoded.notes.append("no transfer is known")
        elif values["response"] != Response.SUCCESS:
            device.transfer = None
        elif transfer.waiting is not None:
            transfer.data += transfer.waiting
            transfer.waiting = None
            transfer.packet = transfer.packet + 1 & 0xFF
            if len(transfer.data) >= transfer.size:
                self._complete(decoded, device, transfer)

    def _complete(self, decoded: Decoded, device: _Device, transfer: _Transfer) -> None:
        device.transfer = None
        data = bytes(transfer.data[: transfer.size])
        number, channel = transfer.parameter, transfer.channel
        self._learn(decoded.node, device, channel, number, data)
        kind = device.kind(channel)
        decoded.fields.append(Field("complete", len(data), _count_text(len(data))))
        if decoded.code == 0x8E:  # the configure frames name them themselves
            decoded.fields += _place_fields(channel, number, kind)
        decoded.fields += _value_fields(_parameter_of(channel, number, kind), data)


def _identity(values: Values) -> Identity:
    return Identity(values["vid"], values["pid"], values["sn"])


def _learn_identity(device: _Device, parameter: int, value: bytes) -> None:
    """Parameters 1 and 2 of a device are who it is."""
    if parameter == 1:
        device.vid_pid = word_at(value), word_at(value, 2)
        if device.identity and device.vid_pid != (device.identity.vid, device.identity.pid):
            device.identity = None  # another device has taken the id
    elif parameter == 2 and device.vid_pid:
        device.identity = Identity(*device.vid_pid, word_at(value))


def _channel_field(channel: int, kind: Kind | None) -> Field:
    of = kind if channel else "the device"
    return Field("channel", channel, f"{channel} ({of})" if of else str(channel))


def _place_fields(channel: int, number: int, kind: Kind | None) -> list[Field]:
    """Which parameter of what."""
    parameter = _parameter_of(channel, number, kind)
    name = f"{number} ({parameter.name})" if parameter else str(number)
    return [Field("parameter", number, name), _channel_field(channel, kind)]


def _plain_field(decoded: Decoded, name: str, value: int) -> Field:
    if name == "time":
        forever = value == 0 and decoded.code == 0x08
        return Field("time", value, f"{value} ms (until released)" if forever else f"{value} ms")
    if name == "packet":
        return Field("packet", value, str(value))
    if value == 0:
        return Field("node", value, "00h (refused)")
    return Field("node", value, f"{_node_text(value)} ({'granted' if value == decoded.node else 'suggested'})")


def format_line(decoded: Decoded) -> str:
    """One line: time, identifier, direction, meaning, fields; then `!` and what is wrong, or notes in brackets."""
    frame = decoded.frame
    seconds, fraction = divmod(frame.time_us, 1_000_000)
    can_id = f"{frame.can_id:08X}" if frame.extended or frame.error else f"{frame.can_id:03X}"
    text = f"{seconds:5d}.{fraction:06d}  {can_id}  {decoded.route:9}  {decoded.meaning}"
    if decoded.fields:
        text += ": " + " ".join(f"{each.name}={each.text}" for each in decoded.fields)
    if decoded.notes:
        text += f" [{', '.join(decoded.notes)}]"
    if decoded.problem:
        text += f" ! {decoded.problem}"
    return text


def to_json(decoded: Decoded) -> dict[str, object]:
    """The same for machines; a field's name occurs once in a frame."""
    frame = decoded.frame
    out: dict[str, object] = {
        "time": frame.time_us / 1_000_000,
        "interface": frame.interface,
        "direction": frame.direction or None,
        "kind": frame.kind,
        "id": frame.can_id,
        "raw": frame.data.hex().upper(),
        "meaning": decoded.meaning,
        "device": str(decoded.device) if decoded.device else None,
    }
    if frame.is_base:
        out |= {
            "priority": decoded.priority,
            "from_arbitrator": decoded.from_arbitrator,
            "node": decoded.node,
            "code": decoded.code if decoded.code >= 0 else None,
        }
    out["fields"] = {each.name: each.value for each in decoded.fields}
    out["notes"] = decoded.notes
    out["problem"] = decoded.problem or None
    return out
