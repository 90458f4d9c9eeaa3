"""Stored configurations: the byte string of [PROFILE 4.5] (profile-layer.md 5) as YAML that people can read and change.

A string that is laid out as links with values becomes a tree of configurations and links, in which only what is in
the string is written, in its order. A string that cannot be told that way (a count at an unusual place, a value
given twice) becomes the list of its entries. Either way `from_yaml(to_yaml(data)) == data`, byte for byte.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import yaml

from .profiles import describe_type, profile_name
from .protocol import ConfigurationCode as Code

__all__ = ["Channel", "Configuration", "Link", "TlvError", "from_yaml", "parse", "to_yaml"]

ENTRY_BYTES = 3
_NUMBER_MAX = 255  # of configurations, links and channels

_VALUES: dict[int, str] = {
    Code.CHANNEL_TYPE: "type",
    Code.CHANNEL_PROFILE: "profile",
    Code.CHANNEL_INDEX: "index",
    Code.OWNER_VID: "vid",
    Code.OWNER_PID: "pid",
    Code.OWNER_SN: "serial",
    Code.OWNER_TYPE: "device_type",
    Code.OWNER_PROFILE: "device_profile",
}
_NAMES: dict[int, str] = {
    Code.CONFIGURATIONS: "number_of_configurations",
    Code.CONFIGURATION: "configuration",
    Code.LINKS: "number_of_links",
    Code.LINK: "link",
    Code.INPUT: "input",
    Code.OUTPUT: "output",
    Code.END: "end",
    **{code: f"channel_{name}" if code <= Code.CHANNEL_INDEX else f"owner_{name}" for code, name in _VALUES.items()},
}
_NAMES[Code.OWNER_TYPE], _NAMES[Code.OWNER_PROFILE] = "owner_type", "owner_profile"
_CODES = {name: code for code, name in _NAMES.items()}
_VALUE_CODES = {name: code for code, name in _VALUES.items()}
_CODE_KEY = re.compile(r"code_([0-9]{1,3})")
LIST_MAX = 0xFFFF  # configurations, or links of one
_DECIMAL = {
    Code.CHANNEL_INDEX,
    Code.CONFIGURATIONS,
    Code.CONFIGURATION,
    Code.LINKS,
    Code.LINK,
    Code.OWNER_VID,
    Code.OWNER_PID,
    Code.OWNER_SN,
}


class TlvError(ValueError):
    """A string or a text that is no set of stored configurations. The message names the place and what is wrong."""


@dataclass(slots=True)
class Channel:
    """One end of a link; a value that was not given is 0."""

    type: int = 0
    profile: int = 0
    index: int = 0
    vid: int = 0
    pid: int = 0
    serial: int = 0
    device_type: int = 0
    device_profile: int = 0


@dataclass(slots=True)
class Link:
    index: int
    input: Channel = field(default_factory=Channel)
    output: Channel = field(default_factory=Channel)


@dataclass(slots=True)
class Configuration:
    index: int
    links: list[Link] = field(default_factory=list)


def _entries(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Offset, code and value of every whole entry."""
    for at in range(0, len(data) - ENTRY_BYTES + 1, ENTRY_BYTES):
        yield at, data[at], data[at + 1] | data[at + 2] << 8


def _pack(code: int, value: int) -> bytes:
    return bytes((code, value & 0xFF, value >> 8))


class _Reader:
    """The reader of profile-layer.md 5, as strict as profile_tlv.h."""

    def __init__(self) -> None:
        self.configurations: list[Configuration] = []
        self.announced: int | None = None  # configurations
        self.links_announced: int | None = None  # links of this configuration
        self.channel: Channel | None = None
        self.ends: set[int] = set()  # input and output of this link that were given

    def entry(self, at: int, code: int, value: int) -> None:
        """Takes one entry other than the end; at is its place, for messages."""
        if code not in _NAMES:
            return
        try:
            self._take(code, value)
        except TlvError as error:
            raise TlvError(f"byte {at}: {error}") from None

    def _take(self, code: int, value: int) -> None:
        if code == Code.CONFIGURATIONS:
            self._count(value)
        elif code == Code.CONFIGURATION:
            self._open_configuration(value)
        elif code == Code.LINKS:
            self._count_links(value)
        elif code == Code.LINK:
            self._open_link(value)
        elif code in (Code.INPUT, Code.OUTPUT):
            self._open_channel(code)
        elif self.channel is None:
            raise TlvError(f"{_NAMES[code]} belongs to no channel")
        elif code == Code.CHANNEL_INDEX and value > _NUMBER_MAX:
            raise TlvError(f"channel index {value} is above {_NUMBER_MAX}")
        else:
            setattr(self.channel, _VALUES[code], value)

    def _count(self, value: int) -> None:
        if self.configurations:
            raise TlvError("the number of configurations comes behind one of them")
        if self.announced is not None:
            raise TlvError("the number of configurations is there twice")
        self.announced = value

    def _open_configuration(self, index: int) -> None:
        self._close_configuration()
        if not 1 <= index <= _NUMBER_MAX:
            raise TlvError(f"configuration {index} is not within 1 to {_NUMBER_MAX}")
        if any(known.index == index for known in self.configurations):
            raise TlvError(f"configuration {index} is there twice")
        self.configurations.append(Configuration(index))
        self.links_announced = None
        self._close_link()

    def _close_link(self) -> None:
        self.channel = None
        self.ends = set()

    def _close_configuration(self) -> None:
        if not self.configurations:
            return
        last, announced = self.configurations[-1], self.links_announced or 0
        if announced != len(last.links):
            raise TlvError(f"configuration {last.index} announces {announced} links and has {len(last.links)}")

    def _count_links(self, value: int) -> None:
        if not self.configurations:
            raise TlvError("a number of links belongs to no configuration")
        if self.links_announced is not None:
            raise TlvError(f"configuration {self.configurations[-1].index} has two numbers of links")
        self.links_announced = value

    def _open_link(self, index: int) -> None:
        if not self.configurations:
            raise TlvError(f"link {index} belongs to no configuration")
        configuration = self.configurations[-1]
        if index > _NUMBER_MAX:
            raise TlvError(f"link {index} is above {_NUMBER_MAX}")
        if any(known.index == index for known in configuration.links):
            raise TlvError(f"link {index} is there twice in configuration {configuration.index}")
        configuration.links.append(Link(index))
        self._close_link()

    def _open_channel(self, code: int) -> None:
        if not self.configurations or not self.configurations[-1].links:
            raise TlvError(f"an {_NAMES[code]} belongs to no link")
        link = self.configurations[-1].links[-1]
        if code in self.ends:
            raise TlvError(f"link {link.index} has two {_NAMES[code]}s")
        self.ends.add(code)
        self.channel = link.input if code == Code.INPUT else link.output

    def end(self) -> list[Configuration]:
        """All configurations, when the end was read."""
        self._close_configuration()
        announced = self.announced or 0
        if announced != len(self.configurations):
            raise TlvError(f"{announced} configurations are announced, {len(self.configurations)} are there")
        return self.configurations


def parse(data: bytes) -> list[Configuration]:
    """Reads a string as an arbitrator does: unknown codes are skipped, missing values are 0, either end of a link may
    come first; what follows the end is not read.

    Raises TlvError: no end, a count that does not match, an index, a count or an end of a link given twice, a number
    out of range, an entry outside of what it belongs to."""
    reader = _Reader()
    for at, code, value in _entries(data):
        if code == Code.END:
            return reader.end()
        reader.entry(at, code, value)
    raise TlvError(f"no end (code {Code.END}) in {len(data)} bytes")


# --- to YAML --------------------------------------------------------------------------------------


def _number(code: int, value: int) -> str:
    return str(value) if code in _DECIMAL else f"0x{value:04X}"


def _comment(code: int, value: int) -> str:
    if code == Code.CHANNEL_TYPE:
        return f"  # {describe_type(value)}"
    if code in (Code.CHANNEL_PROFILE, Code.OWNER_PROFILE) and profile_name(value):
        return f"  # {profile_name(value)}"
    return ""


class _Tree:
    """Writes a string as a tree, as far as it has the usual shape."""

    def __init__(self, data: bytes) -> None:
        self.entries = [(code, value) for _, code, value in _entries(data)]
        self.at = 0
        self.lines: list[str] = ["configurations:"]

    def _is(self, code: int) -> bool:
        return self.at < len(self.entries) and self.entries[self.at][0] == code

    def _take(self) -> tuple[int, int]:
        self.at += 1
        return self.entries[self.at - 1]

    def write(self) -> str:
        """The text; what it says may be less than the string holds, which the caller checks."""
        if self._is(Code.CONFIGURATIONS):
            self._take()
        start = len(self.lines)
        while self._is(Code.CONFIGURATION):
            self._configuration(self._take()[1])
        if len(self.lines) == start:
            self.lines = ["configurations: []"]
        return "\n".join(self.lines) + "\n"

    def _configuration(self, index: int) -> None:
        self.lines.append(f"- configuration: {index}")
        if self._is(Code.LINKS):
            self._take()
        self._others("  ")
        if not self._is(Code.LINK):
            self.lines.append("  links: []")
            return
        self.lines.append("  links:")
        while self._is(Code.LINK):
            self.lines.append(f"  - link: {self._take()[1]}")
            self._others("    ")
            while self._is(Code.INPUT) or self._is(Code.OUTPUT):
                self._channel(_NAMES[self._take()[0]])

    def _others(self, indent: str) -> None:
        while self.at < len(self.entries) and self.entries[self.at][0] not in _NAMES:
            code, value = self._take()
            self.lines.append(f"{indent}code_{code}: {_number(code, value)}")

    def _channel(self, name: str) -> None:
        values = []
        while self.at < len(self.entries) and (
            self.entries[self.at][0] in _VALUES or self.entries[self.at][0] not in _NAMES
        ):
            code, value = self._take()
            key = _VALUES.get(code) or f"code_{code}"
            values.append(f"      {key}: {_number(code, value)}{_comment(code, value)}")
        self.lines.append(f"    {name}:" if values else f"    {name}: {{}}")
        self.lines += values


def _entry_list(data: bytes) -> str:
    lines = []
    for _, code, value in _entries(data):
        key = _NAMES.get(code) or f"code_{code}"
        lines.append(f"- {key}: {_number(code, value)}{_comment(code, value)}")
    left = data[len(data) - len(data) % ENTRY_BYTES :] if len(data) % ENTRY_BYTES else b""
    head = ["entries:", *lines] if lines else ["entries: []"]
    return "\n".join([*head, *([f'rest: "{left.hex().upper()}"'] if left else [])]) + "\n"


def to_yaml(data: bytes, entries: bool = False) -> str:
    """The string as YAML. Any bytes will do; what an arbitrator rejects comes out as entries, and so does all if
    asked."""
    if entries:
        return _entry_list(data)
    try:
        parse(data)
        text = _Tree(data).write()
        if from_yaml(text) == data:
            return text
    except TlvError:
        pass
    return _entry_list(data)


# --- from YAML ------------------------------------------------------------------------------------


def _fail(node: yaml.Node, message: str) -> TlvError:
    return TlvError(f"line {node.start_mark.line + 1}: {message}")


def _items(node: yaml.Node, what: str) -> list[tuple[str, yaml.Node, yaml.Node]]:
    """Key, its node and value node of a mapping, in order, each key once."""
    if not isinstance(node, yaml.MappingNode):
        raise _fail(node, f"{what} must hold names and values")
    items: list[tuple[str, yaml.Node, yaml.Node]] = []
    for key, value in node.value:
        name = str(key.value) if isinstance(key, yaml.ScalarNode) else "?"
        if any(known == name for known, _, _ in items):
            raise _fail(key, f"{name} is there twice")
        items.append((name, key, value))
    return items


def _list(node: yaml.Node, what: str) -> list[yaml.Node]:
    if not isinstance(node, yaml.SequenceNode):
        raise _fail(node, f"{what} must be a list")
    if len(node.value) > LIST_MAX:
        raise _fail(node, f"{what} has {len(node.value)} items, more than {LIST_MAX}")
    return list(node.value)


def _word(node: yaml.Node, what: str) -> int:
    text = str(node.value) if isinstance(node, yaml.ScalarNode) else ""
    try:
        value = int(text, 0)
    except ValueError:
        raise _fail(node, f"{what} must be a number, 0 to 65535 or 0x0 to 0xFFFF") from None
    if not 0 <= value <= 0xFFFF:
        raise _fail(node, f"{what} is {text}, which is not within 0 to 65535")
    return value


def _other(name: str, key: yaml.Node, value: yaml.Node, known: str) -> bytes:
    """An entry that is given by its number, `code_200: 5`."""
    match = _CODE_KEY.fullmatch(name)
    code = int(match[1]) if match else 0x100
    if code > 0xFF or code in _NAMES:
        raise _fail(key, f"{name} is not known here; known are {known} and code_N with N an unknown code of 0 to 255")
    return _pack(code, _word(value, name))


def _channel_bytes(code: int, node: yaml.Node) -> bytes:
    out = _pack(code, 0)
    for name, key, value in _items(node, _NAMES[code]):
        known = _VALUE_CODES.get(name)
        if known is None:
            out += _other(name, key, value, ", ".join(_VALUE_CODES))
        else:
            out += _pack(known, _word(value, name))
    return out


def _link_bytes(node: yaml.Node) -> bytes:
    items = _items(node, "a link")
    if not items or items[0][0] != "link":
        raise _fail(node, "a link must begin with link, its index")
    out = _pack(Code.LINK, _word(items[0][2], "link"))
    for name, key, value in items[1:]:
        if name in ("input", "output"):
            out += _channel_bytes(_CODES[name], value)
        else:
            out += _other(name, key, value, "input, output")
    return out


def _configuration_bytes(node: yaml.Node) -> bytes:
    items = _items(node, "a configuration")
    if not items or items[0][0] != "configuration":
        raise _fail(node, "a configuration must begin with configuration, its index")
    if items[-1][0] != "links":
        raise _fail(node, "a configuration must end with links")
    links = _list(items[-1][2], "links")
    out = _pack(Code.CONFIGURATION, _word(items[0][2], "configuration")) + _pack(Code.LINKS, len(links))
    for name, key, value in items[1:-1]:
        out += _other(name, key, value, "links")
    return out + b"".join(_link_bytes(link) for link in links)


def _entry_bytes(node: yaml.Node) -> bytes:
    items = _items(node, "an entry")
    if len(items) != 1:
        raise _fail(node, "an entry must be one name and its value")
    name, key, value = items[0]
    known = _CODES.get(name)
    return _other(name, key, value, ", ".join(_CODES)) if known is None else _pack(known, _word(value, name))


def _rest_bytes(node: yaml.Node) -> bytes:
    try:
        return bytes.fromhex(str(node.value))
    except ValueError:
        raise _fail(node, "rest must be bytes in hexadecimal") from None


class _Loader(yaml.SafeLoader):
    """Without aliases: a few lines with them stand for millions."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.MarkedYAMLError(problem="an alias, which is not allowed here", problem_mark=mark)
        return super().compose_node(parent, index)


def _compose(text: str) -> yaml.Node:
    try:
        node = yaml.compose(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise TlvError(f"line {line}: {error.problem or error.context or 'no YAML'}") from None
    except (yaml.YAMLError, RecursionError) as error:
        raise TlvError(f"no YAML: {str(error).splitlines()[0]}") from None
    if node is None:
        raise TlvError("line 1: the text is empty")
    return node


def from_yaml(text: str) -> bytes:
    """The byte string of a text that to_yaml() wrote or that a person did. Raises TlvError with the line. The
    string is not parsed: whoever stores it calls parse() first."""
    root = _compose(text)
    items = _items(root, "the text")
    names = [name for name, _, _ in items]
    if names == ["configurations"]:
        configurations = _list(items[0][2], "configurations")
        body = b"".join(_configuration_bytes(each) for each in configurations)
        return _pack(Code.CONFIGURATIONS, len(configurations)) + body + _pack(Code.END, 0)
    if names in (["entries"], ["entries", "rest"]):
        out = b"".join(_entry_bytes(each) for each in _list(items[0][2], "entries"))
        return out + (_rest_bytes(items[1][2]) if len(items) == 2 else b"")
    raise _fail(root, "there must be configurations, or else entries and perhaps rest")
