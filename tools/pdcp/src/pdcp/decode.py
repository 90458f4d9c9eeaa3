"""What frames on a PDCP bus say (pdcp-bus.md), every field by its name.

A Decoder learns from the traffic: who has which node id (bind answers), which way a channel goes and what it
carries (its parameters), which id an output sends from. What it has not seen it does not guess: such values stay
raw.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from .frames import Frame
from .values import (
    DIRECTIONS,
    INPUT,
    NO_CHANNEL,
    ONLY_INPUTS,
    OUTPUT,
    Field,
    channel_value,
    count_text,
    ms_text,
    node_text,
    parameter_of,
    profile_text,
    raw_text,
    value_fields,
    word_at,
)

__all__ = ["Decoded", "Decoder", "format_line", "to_json"]

_BINDING = 3
_NODE_MAX = 254
_UNUSED_NODE = 255
_FAILURE, _SUCCESS, _USE_BULK = 0, 1, 2
_RESPONSES = {_FAILURE: "failure", _SUCCESS: "success"}
_PARAMETER_RESPONSES = {**_RESPONSES, _USE_BULK: "use bulk transfer"}
_OTHER_KINDS = {"extended": "Extended Frame", "remote": "Remote Frame", "error": "Error Frame", "fd": "CAN FD Frame"}
_BROADCASTS = (0x08, 0x09, 0x0A, 0x0B)
_BEACON = 0x0A
_ANSWERED = (0x03, 0x04, 0x08, 0x09, 0x0B, 0x0C, 0x0D, 0x0F)
_DEPRECATED = (0x02, 0x05, 0x06, 0x07, 0x82, 0x85, 0x86, 0x87)


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
    device: str = ""  # identity of the device that sends or is addressed, if it is known

    @property
    def priority(self) -> int:
        return self.frame.can_id >> 9 & 3

    @property
    def from_arbitrator(self) -> bool:
        return bool(self.frame.can_id & 0x100)

    @property
    def node(self) -> int:
        return self.frame.can_id & 0xFF


# --- wire layout ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Function:
    name: str
    sizes: tuple[int, ...]
    layout: tuple[tuple[str, int], ...] = ()  # name and bytes; 0: all that is left
    device: bool = False  # a device may send it
    arbitrator: bool = False


_IDENTITY = (("vid", 2), ("pid", 2), ("serial", 2))
_PARAMETER = (("parameter", 1), ("channel", 1))
_RESPONSE = (("response", 1),)
_VALUE = (("value", 0),)
_REST = (("rest", 0),)  # of the deprecated codes only the sizes are known
_SIZE = (("size", 2),)


def _range(low: int, high: int) -> tuple[int, ...]:
    return tuple(range(low, high + 1))


# The sizes of [PDCP 3.2]; one that only [PDCP 3.1] has stands behind (D-BUS-3).
_FUNCTIONS = {
    0x01: _Function("Bind Device Request", (7,), _IDENTITY, device=True),
    0x02: _Function("GetDeviceInfo", (2,), _REST, arbitrator=True),
    0x03: _Function("Get Device Parameter", (3,), _PARAMETER, arbitrator=True),
    0x04: _Function("Set Device Parameter", _range(4, 7), _PARAMETER + _VALUE, arbitrator=True),
    0x05: _Function("IndGetDeviceParameter", (4,), _REST, device=True),
    0x06: _Function("IndSetDeviceParameter", _range(5, 8), _REST, device=True),
    0x07: _Function("SetNodeId", (2,), _REST, arbitrator=True),
    0x08: _Function("Suspend Device", (3,), (("time", 2),), arbitrator=True),
    0x09: _Function("Release Device", (1,), arbitrator=True),
    0x0A: _Function("Device Beacon", (1,), device=True, arbitrator=True),
    0x0B: _Function("Reset Device", (1,), arbitrator=True),
    0x0C: _Function("Configure Get Bulk Data Transfer", (3, 5), _PARAMETER + _SIZE, arbitrator=True),
    0x0D: _Function("Configure Set Bulk Data Transfer", (5,), _PARAMETER + _SIZE, arbitrator=True),
    0x0E: _Function("Bulk Data Transfer", _range(3, 8), (("packet", 1), ("data", 0)), device=True, arbitrator=True),
    0x0F: _Function("Update Data Channel", (2,), (("channel", 1),), device=True),
    0x81: _Function("Bind Device Response", (8,), (("node", 1), *_IDENTITY), arbitrator=True),
    0x82: _Function("GetDeviceInfo Response", _range(2, 6), _REST, device=True),
    0x83: _Function("Get Device Parameter Response", _range(4, 8), _RESPONSE + _PARAMETER + _VALUE, device=True),
    0x84: _Function("Set Device Parameter Response", (5, 6, 7, 8, 4), _RESPONSE + _PARAMETER + _VALUE, device=True),
    0x85: _Function("IndGetDeviceParameter Response", _range(4, 7), _REST, arbitrator=True),
    0x86: _Function("IndSetDeviceParameter Response", (1,), arbitrator=True),
    0x87: _Function("SetNodeId Response", (1,), device=True),
    0x88: _Function("Suspend Device Response", (4, 1), _RESPONSE + (("time", 2),), device=True),
    0x89: _Function("Release Device Response", (2, 1), _RESPONSE, device=True),
    0x8B: _Function("Reset Device Response", (2, 1), _RESPONSE, device=True),
    0x8C: _Function("Configure Get Bulk Data Transfer Response", (6,), _RESPONSE + _PARAMETER + _SIZE, device=True),
    0x8D: _Function("Configure Set Bulk Data Transfer Response", (6,), _RESPONSE + _PARAMETER + _SIZE, device=True),
    0x8E: _Function("Bulk Data Transfer Response", (2,), _RESPONSE, device=True, arbitrator=True),
    0x8F: _Function("Update Data Channel Response", (3,), _RESPONSE + (("channel", 1),), arbitrator=True),
}


def _code_class(code: int) -> str:
    """What a code without a function of its own is [PDCP 3.1]."""
    for low, high, name in (
        (0x10, 0x4F, "Reserved System Code"),
        (0x50, 0x7F, "Device-Specific Code"),
        (0x90, 0xCF, "Reserved System Response"),
        (0xD0, 0xFE, "Device-Specific Response"),
    ):
        if low <= code <= high:
            return name
    return "Unknown Code"


def _sizes_text(sizes: tuple[int, ...]) -> str:
    ordered = sorted(sizes)
    if len(ordered) > 2 and ordered == list(range(ordered[0], ordered[-1] + 1)):
        return f"{ordered[0]} to {ordered[-1]} bytes"
    text = " or ".join(str(size) for size in ordered)
    return f"{text} byte" if ordered == [1] else f"{text} bytes"


# --- what is known --------------------------------------------------------------------------------


@dataclass(slots=True)
class _Channel:
    direction: int = 0
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
    identity: str = ""
    vid_pid: str = ""
    channels: dict[int, _Channel] = field(default_factory=dict)
    written: dict[tuple[int, int], bytes] = field(default_factory=dict)  # channel, parameter: not answered yet
    asked: set[tuple[int, int, int]] = field(default_factory=set)  # code, parameter, channel: not answered yet
    transfer: _Transfer | None = None

    def channel(self, index: int) -> _Channel:
        return self.channels.setdefault(index, _Channel())

    def direction(self, index: int) -> int:
        known = self.channels.get(index)
        return known.direction if known else 0


@dataclass(frozen=True, slots=True)
class _Output:
    node: int  # of its device
    index: int  # 0: not known


class _Values(dict[str, int]):
    """The numbers of a message by name, and the bytes at its end."""

    tail: bytes = b""


class Decoder:
    """Decodes frames one after the other, in the order of the bus. Any frame will do; nothing raises."""

    def __init__(self) -> None:
        self._devices: dict[int, _Device] = {}
        self._outputs: dict[int, _Output] = {}

    # --- for others ---

    def sender(self, frame: Frame) -> str:
        """Who sent a frame, as far as is known by now: `arbitrator`, `0002:0002:0004`, `0002:0002:0004 channel 1`,
        `node 11h`, or `other frames` for what PDCP does not use."""
        if not frame.is_base:
            return "other frames"
        if frame.can_id & 0x100:
            return "arbitrator"
        node = frame.can_id & 0xFF
        if frame.can_id >> 9 == _BINDING:
            vid, pid, serial = (word_at(frame.data, at) for at in (1, 3, 5))
            return f"{vid:04X}:{pid:04X}:{serial:04X}"
        output = self._outputs.get(node)
        if output is not None:
            return self._output_text(node, output)
        device = self._devices.get(node)
        return device.identity if device and device.identity else f"node {node_text(node)}"

    def decode(self, frame: Frame) -> Decoded:
        """What a frame says. Learns from it."""
        if not frame.is_base:
            decoded = Decoded(frame, _OTHER_KINDS[frame.kind], problem="PDCP uses base data frames alone")
            decoded.fields = self._raw_fields(frame)
            return decoded
        decoded = Decoded(frame, "")
        node = decoded.node
        decoded.route = self._route(decoded)
        known = self._devices.get(node)
        decoded.device = known.identity if known else ""
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
        node = node_text(decoded.node)
        if decoded.from_arbitrator:
            return f"BA > {node if decoded.node else 'all'}"
        return f"{node} > *" if decoded.node in self._outputs and decoded.priority != _BINDING else f"{node} > BA"

    @staticmethod
    def _raw_fields(frame: Frame) -> list[Field]:
        return [Field("data", frame.data.hex().upper(), raw_text(frame.data))]

    def _binding(self, decoded: Decoded) -> None:
        """Priority 3: bind requests alone."""
        frame = decoded.frame
        if decoded.from_arbitrator:
            decoded.meaning, decoded.problem = "Binding Frame", "priority 3 with mode 1 is not used"
            decoded.fields = self._raw_fields(frame)
        elif frame.data[:1] != b"\x01":
            decoded.meaning, decoded.problem = "Binding Frame", "priority 3 is for Bind Device Request alone"
            decoded.fields = self._raw_fields(frame)
        else:
            self._message(decoded)
            decoded.fields.insert(0, Field("requested", decoded.node, node_text(decoded.node)))
            decoded.device = self.sender(frame) if not decoded.problem else ""

    def _stranger(self, decoded: Decoded) -> None:
        """An id that nothing is known of: a message if it can be one, else perhaps channel data."""
        code = decoded.frame.data[0] if decoded.frame.data else -1
        function = _FUNCTIONS.get(code)
        if function is not None and function.device and len(decoded.frame.data) in function.sizes:
            self._message(decoded)
        else:
            decoded.meaning = "Channel Data or unknown"
            decoded.fields = self._raw_fields(decoded.frame)
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
        decoded.device = device.identity if device else ""
        text = self._output_text(node, output)
        decoded.fields = [Field("output", text, text)]
        if channel is not None and channel.type >= 0:
            decoded.fields.append(Field("profile", channel.profile, profile_text(channel.profile)))
            decoded.fields += channel_value(channel.type, data)
        decoded.fields += self._raw_fields(decoded.frame)

    def _output_text(self, node: int, output: _Output) -> str:
        device = self._devices.get(output.node)
        who = device.identity if device and device.identity else f"node {node_text(output.node)}"
        return f"{who} channel {output.index}" if output.index else f"{who} output {node_text(node)}"

    # --- messages ---

    def _message(self, decoded: Decoded) -> None:
        data = decoded.frame.data
        if not data:
            decoded.meaning, decoded.problem = "Empty Frame", "there is no function code"
            return
        decoded.code = data[0]
        function = _FUNCTIONS.get(data[0])
        if function is None:
            name = _code_class(data[0])
            decoded.meaning = f"{name} {data[0]:02X}h"
            if name == "Unknown Code":
                decoded.problem = "the protocol has no such code"
            decoded.fields = [Field("rest", data[1:].hex().upper(), raw_text(data[1:]))]
            self._check_place(decoded)
            return
        decoded.meaning = function.name
        if len(data) not in function.sizes:
            decoded.problem = f"must have {_sizes_text(function.sizes)}, has {len(data)}"
            decoded.fields = [Field("rest", data[1:].hex().upper(), raw_text(data[1:]))]
            return
        self._fields(decoded, function)
        self._check_place(decoded)
        if not decoded.problem:
            self._follow(decoded)

    def _fields(self, decoded: Decoded, function: _Function) -> None:
        values = _split(function, decoded.frame.data)
        if decoded.code in _DEPRECATED:
            decoded.notes.append("deprecated")
        if "response" in dict(function.layout):
            decoded.fields.append(self._response(decoded, values))
        for name in ("node", "time", "packet"):
            if name in values:
                decoded.fields.append(_plain_field(decoded, name, values[name]))
        if "vid" in values:
            vid, pid, serial = (values[name] for name in ("vid", "pid", "serial"))
            decoded.fields += [Field(n, v, f"{v:04X}h") for n, v in (("vid", vid), ("pid", pid), ("serial", serial))]
        self._parameter_fields(decoded, values)
        if "size" in values:
            decoded.fields.append(Field("size", values["size"], count_text(values["size"])))
        name, size = function.layout[-1] if function.layout else ("", 1)
        if size == 0 and name != "value":
            decoded.fields.append(Field(name, values.tail.hex().upper(), raw_text(values.tail)))

    def _response(self, decoded: Decoded, values: _Values) -> Field:
        if "response" not in values:
            return Field("response", _SUCCESS, "success (not said, D-BUS-18)")
        number = values["response"]
        names = _PARAMETER_RESPONSES if decoded.code in (0x83, 0x84) else _RESPONSES
        return Field("response", number, names.get(number, f"{number} (not defined)"))

    def _parameter_fields(self, decoded: Decoded, values: _Values) -> None:
        if "channel" not in values:
            return
        channel = values["channel"]
        direction = self._direction(decoded, values)
        of = DIRECTIONS.get(direction, "") if channel else "the device"
        place = Field("channel", channel, f"{channel} ({of})" if of else str(channel))
        if "parameter" not in values:
            decoded.fields.append(place)
            return
        number = values["parameter"]
        parameter = parameter_of(channel, number, direction)
        name = parameter.name if parameter else ""
        decoded.fields.append(Field("parameter", number, f"{number} ({name})" if name else str(number)))
        decoded.fields.append(place)
        if values.tail or (decoded.code == 0x83 and values["response"] == _SUCCESS):
            decoded.fields += value_fields(parameter, values.tail)

    def _direction(self, decoded: Decoded, values: _Values) -> int:
        """Which way a channel goes: as its transfer type said, or as what is written to it tells."""
        channel = values["channel"]
        device = self._devices.get(decoded.node)
        known = device.direction(channel) if device else 0
        if known or channel == 0:
            return known
        number, size = values.get("parameter"), len(values.tail)
        if decoded.code in (0x0F, 0x8F) or number in ONLY_INPUTS:
            return INPUT
        if number == 5 and size:
            return OUTPUT if size == 1 else INPUT
        return 0

    def _check_place(self, decoded: Decoded) -> None:
        """A sound message from who must not send it, or to whom it must not go."""
        function = _FUNCTIONS.get(decoded.code)
        if decoded.problem:
            return
        if not decoded.from_arbitrator and decoded.priority != _BINDING and decoded.node in (0, _UNUSED_NODE):
            decoded.problem = f"no device has the id {node_text(decoded.node)}"
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
        elif decoded.from_arbitrator and decoded.node and decoded.code == _BEACON:
            decoded.problem = "an arbitrator beacons to all"

    # --- learning ---

    def _follow(self, decoded: Decoded) -> None:
        """What the next frames mean depends on this one."""
        code, node = decoded.code, decoded.node
        values = _split(_FUNCTIONS[code], decoded.frame.data)
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
    def _pair(decoded: Decoded, device: _Device, values: _Values) -> None:
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

    def _bound(self, decoded: Decoded, values: _Values) -> None:
        requested, granted = decoded.node, values["node"]
        identity = ":".join(f"{values[name]:04X}" for name in ("vid", "pid", "serial"))
        decoded.device = identity
        if granted != requested or not 1 <= granted <= _NODE_MAX:
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

    def _answered(self, decoded: Decoded, device: _Device, values: _Values) -> None:
        channel, parameter = values["channel"], values["parameter"]
        written = device.written.pop((channel, parameter), b"") if decoded.code == 0x84 else b""
        if values.get("response") == _SUCCESS:
            self._learn(decoded.node, device, channel, parameter, values.tail or written)

    def _learn(self, node: int, device: _Device, channel: int, parameter: int, value: bytes) -> None:
        """A parameter has this value."""
        if channel == 0:
            if parameter == 1:
                device.vid_pid = f"{word_at(value):04X}:{word_at(value, 2):04X}"
                if not device.identity.startswith(device.vid_pid):
                    device.identity = ""  # another device has taken the id
            elif parameter == 2 and device.vid_pid:
                device.identity = f"{device.vid_pid}:{word_at(value):04X}"
            return
        known = device.channel(channel)
        if parameter == 3 and word_at(value, 0, 1) in DIRECTIONS:
            known.direction = word_at(value, 0, 1)
        elif parameter == 1:
            known.type, known.profile = word_at(value), word_at(value, 2)
        elif parameter == 5 and (known.direction == OUTPUT or (not known.direction and len(value) == 1)):
            known.direction = OUTPUT
            self._output_node(word_at(value, 0, 1), _Output(node, channel))
        elif parameter in ONLY_INPUTS and known.direction != OUTPUT:
            known.direction = INPUT
            self._learn_source(known, parameter, value)

    def _learn_source(self, known: _Channel, parameter: int, value: bytes) -> None:
        """What an input hears tells of the output that it hears, too."""
        if parameter == 6:
            known.source_channel = 0 if word_at(value, 2, 1) == NO_CHANNEL else word_at(value, 2, 1)
        elif parameter == 7 and word_at(value, 1, 1) and word_at(value, 1, 1) not in self._outputs:
            self._output_node(word_at(value, 1, 1), _Output(word_at(value, 0, 1), known.source_channel))

    def _output_node(self, node: int, output: _Output) -> None:
        if 1 <= node <= _NODE_MAX and node != output.node:
            for old in [key for key, other in self._outputs.items() if other == output and output.index]:
                del self._outputs[old]
            self._outputs[node] = output
            self._devices.pop(node, None)

    # --- bulk transfer ---

    def _configured(self, decoded: Decoded, device: _Device, values: _Values) -> None:
        transfer = device.transfer
        asked = (values["parameter"], values["channel"], decoded.code == 0x8D)
        if transfer is None or asked != (transfer.parameter, transfer.channel, transfer.to_device):
            return
        if values["response"] != _SUCCESS:
            device.transfer = None
        else:
            transfer.size = values["size"]
            if transfer.size == 0:
                self._complete(decoded, device, transfer)

    def _packet(self, decoded: Decoded, device: _Device, values: _Values) -> None:
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
            decoded.fields.append(Field("offset", begin, f"{begin} of {count_text(transfer.size)}"))
            if end > transfer.size:
                decoded.notes.append(f"{count_text(end - transfer.size)} too many")
        elif packet == transfer.packet - 1 & 0xFF and transfer.data:
            decoded.notes.append("repeated")
        else:
            decoded.notes.append(f"packet {transfer.packet} was expected")

    def _acknowledged(self, decoded: Decoded, device: _Device, values: _Values) -> None:
        transfer = device.transfer
        if transfer is None or transfer.size < 0 or transfer.to_device == decoded.from_arbitrator:
            decoded.notes.append("no transfer is known")
        elif values["response"] != _SUCCESS:
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
        parameter = parameter_of(channel, number, device.direction(channel))
        decoded.fields.append(Field("complete", len(data), count_text(len(data))))
        if decoded.code == 0x8E:  # the configure frames name them themselves
            name = f"{number} ({parameter.name})" if parameter else str(number)
            decoded.fields.append(Field("parameter", number, name))
            of = DIRECTIONS.get(device.direction(channel), "") if channel else "the device"
            decoded.fields.append(Field("channel", channel, f"{channel} ({of})" if of else str(channel)))
        decoded.fields += value_fields(parameter, data)


def _split(function: _Function, data: bytes) -> _Values:
    """The fields that are there, by name."""
    values = _Values()
    at = 1
    for name, size in function.layout:
        if size == 0:
            values.tail = data[at:]
        elif len(data) >= at + size:
            values[name] = word_at(data, at, size)
        at += size
    return values


def _plain_field(decoded: Decoded, name: str, value: int) -> Field:
    if name == "time":
        return Field(
            "time", value, ms_text(value) + (" (until released)" if value == 0 and decoded.code == 0x08 else "")
        )
    if name == "packet":
        return Field("packet", value, str(value))
    if value == 0:
        return Field("node", value, "00h (refused)")
    return Field("node", value, f"{node_text(value)} ({'granted' if value == decoded.node else 'suggested'})")


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
        "device": decoded.device or None,
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
