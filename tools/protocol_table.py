"""Reads docs/spec/protocol.toml, whose head explains it, and checks that it is sound."""

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

PLACE = Path("docs/spec/protocol.toml")

# Bytes of a type, least and most; None: to the end.
SIZES: dict[str, tuple[int, int | None]] = {
    "u8": (1, 1),
    "u16": (2, 2),
    "u32": (4, 4),
    "dev": (6, 6),
    "chan": (7, 7),
    "mask": (1, 2),
    "bytes8": (8, 8),
    "bytes": (0, None),
    "bytes+": (1, None),
    "u32*": (0, None),
}
MEANINGS = ("", "ms", "node", "word", "type", "profile", "switch")
SENDERS = ("device", "arbitrator")
KINDS = ("device", "input", "output")
FORMS = ("fields", "text", "channels")
ACCESS = ("read", "arbitrator", "write")
INHERITED = ("scale", "mode", "sign", "rate", "safe")
FRAME_MAX = 8
ANSWER = 0x80

FIELD = re.compile(r"([a-z]\w*): (\S+)(?: (\w+))?")


class TableError(Exception):
    """The table is not sound. The message names the place."""


@dataclass(frozen=True)
class Field:
    name: str
    type: str
    meaning: str

    @property
    def least(self) -> int:
        return SIZES[self.type][0]

    @property
    def most(self) -> int | None:
        """Bytes; None: to the end."""
        return SIZES[self.type][1]


@dataclass(frozen=True)
class Value:
    """A number of a set. c: its name in C, "" for none; client: for programs at the host, "" for none."""

    number: int
    name: str
    text: str
    c: str
    client: str
    cite: str = ""
    later: bool = False


@dataclass(frozen=True)
class NumberSet:
    id: str
    text: str
    cite: str = ""
    c: str = ""
    client: str = ""
    flags: bool = False
    later: bool = False
    values: tuple[Value, ...] = ()


@dataclass(frozen=True)
class Layout:
    """What a function code, a request or an answer, looks like in a frame."""

    number: int
    text: str
    senders: tuple[str, ...]
    dlc: tuple[int, ...]
    fields: tuple[Field, ...]
    also: tuple[int, ...] = ()
    to_all: bool = False
    deprecated: bool = False


@dataclass(frozen=True)
class Function:
    name: str
    cite: str
    request: Layout
    answer: Layout | None

    @property
    def layouts(self) -> tuple[Layout, ...]:
        return (self.request,) if self.answer is None else (self.request, self.answer)


@dataclass(frozen=True)
class Range:
    first: int
    last: int
    text: str
    cite: str


@dataclass(frozen=True)
class Parameter:
    of: tuple[str, ...]
    number: int
    name: str
    client: str
    access: str
    cite: str
    fields: tuple[Field, ...] = ()
    form: str = "fields"
    mandatory: bool = False
    unconnected: tuple[int, ...] = ()
    later: bool = False


@dataclass(frozen=True)
class Message:
    """A message of the host API: from the host with request, success and failure, or from the arbitrator alone with
    fields. coming: more fields of each, not built yet."""

    number: int
    name: str
    client: str
    text: str
    cite: str
    sender: str = "host"
    answer: str = ""
    reads: bool = False
    request: tuple[Field, ...] = ()
    success: tuple[Field, ...] = ()
    failure: tuple[Field, ...] = ()
    failure_text: str = ""
    fields: tuple[Field, ...] = ()
    coming: Mapping[str, tuple[Field, ...]] = field(default_factory=dict)
    later: bool = False


@dataclass(frozen=True)
class Event:
    number: int
    name: str
    client: str
    text: str
    cite: str
    fields: tuple[Field, ...]
    later: bool = False


@dataclass(frozen=True)
class Counter:
    name: str
    text: str
    c: str


@dataclass(frozen=True)
class Group:
    """c: prefix of enumerators whose numbers are the places of the counters; "" where there is none."""

    number: int
    name: str
    client: str
    text: str
    cite: str
    counters: tuple[Counter, ...]
    c: str = ""


@dataclass(frozen=True)
class Profile:
    """A node of the tree, with what it inherits."""

    word: int
    path: str
    name: str
    means: str
    scale: str
    mode: str
    sign: str
    rate: str
    safe: str


@dataclass(frozen=True)
class Table:
    version: int
    sets: tuple[NumberSet, ...]
    functions: tuple[Function, ...]
    ranges: tuple[Range, ...]
    parameters: tuple[Parameter, ...]
    message_groups: Mapping[int, str]
    messages: tuple[Message, ...]
    events: tuple[Event, ...]
    counters: tuple[Group, ...]
    profiles: tuple[Profile, ...]

    def c_numbers(self) -> Iterator[tuple[str, int]]:
        """Every name that the C code has for a number, with the number; what is not built yet has none."""
        yield "ARB_VERSION_PROTOCOL", self.version
        for numbers in self.sets:
            yield from ((value.c, value.number) for value in built(numbers.values) if value.c and not numbers.later)
        yield from ((f"PDCP_{function.name}", function.request.number) for function in self.functions)
        yield from ((f"PDCP_{parameter.name}", parameter.number) for parameter in built(self.parameters))
        yield from ((f"ARB_MSG_{message.name}", message.number) for message in built(self.messages))
        yield from ((f"ARB_EVENT_{event.name}", event.number) for event in built(self.events))
        for group in self.counters:
            yield from ((counter.c, place) for place, counter in enumerate(group.counters) if group.c)
        yield from (("PROFILE_" + node.path.upper().replace(".", "_"), node.word) for node in self.profiles)


LaterT = TypeVar("LaterT", Value, NumberSet, Parameter, Message, Event)


def built(rows: Iterable[LaterT]) -> Iterator[LaterT]:
    """Without those that are not built yet."""
    return (row for row in rows if not row.later)


def sizes_of(layout: Sequence[Field]) -> tuple[int, int | None]:
    """Bytes of a payload, least and most; None: any number."""
    open_end = any(each.most is None for each in layout)
    return sum(each.least for each in layout), None if open_end else sum(each.most or 0 for each in layout)


# --- reading --------------------------------------------------------------------------------------


RowT = TypeVar("RowT")


def _build(kind: type[RowT], row: Mapping[str, Any], where: str, **made: object) -> RowT:
    """An entry from its keys and from what was made of some of them."""
    known = {each.name for each in fields(kind)}  # type: ignore[arg-type] # all kinds are dataclasses
    unknown = sorted((row.keys() | made.keys()) - known)
    if unknown:
        raise TableError(f"{where}: unknown key {', '.join(unknown)}")
    try:
        return kind(**{**row, **made})
    except TypeError as error:
        raise TableError(f"{where}: {error}") from None


def _fields(texts: Sequence[str], where: str, meanings: frozenset[str]) -> tuple[Field, ...]:
    found = []
    for text in texts:
        match = FIELD.fullmatch(text)
        if not match or match[2] not in SIZES or (match[3] or "") not in meanings:
            raise TableError(f'{where}: "{text}" is no field')
        found.append(Field(match[1], match[2], match[3] or ""))
    if any(each.most is None for each in found[:-1]):
        raise TableError(f"{where}: a field stands behind one that takes all that is left")
    _once([each.name for each in found], where)
    return tuple(found)


def _once(names: Iterable[object], where: str) -> None:
    seen: set[object] = set()
    for name in names:
        if name in seen:
            raise TableError(f"{where}: {name} is there twice")
        seen.add(name)


def _one_of(value: str, known: Sequence[str], where: str) -> None:
    if value not in known:
        raise TableError(f"{where}: {value} is none of {', '.join(known)}")


def _set(row: dict[str, Any]) -> NumberSet:
    prefix = row.get("c", "")
    values = []
    for each in row["values"]:
        where = f"set {row['id']}, {each.get('name')}"
        in_class = each["name"] if "client" in row else ""
        made = {
            "c": each.get("c", f"{prefix}{each['name']}" if prefix else ""),
            "client": each.get("client", in_class),
        }
        values.append(_build(Value, each, where, **made))
    _once((each.client for each in values if each.client), f"set {row['id']}")
    return _build(NumberSet, row, f"set {row['id']}", values=tuple(values))


def _layout(row: dict[str, Any], where: str, meanings: frozenset[str]) -> Layout:
    rest = {key: value for key, value in row.items() if key not in ("from", "name", "cite", "answer")}
    made = {
        "senders": tuple(row["from"]),
        "dlc": tuple(row["dlc"]),
        "also": tuple(row.get("also", ())),
        "fields": _fields(row["fields"], where, meanings),
    }
    layout = _build(Layout, rest, where, **made)
    for sender in layout.senders:
        _one_of(sender, SENDERS, where)
    sizes = (*layout.dlc, *layout.also)
    least, most = sizes_of(layout.fields)
    if not 1 <= min(sizes) <= max(sizes) <= FRAME_MAX:
        raise TableError(f"{where}: a frame has 1 to {FRAME_MAX} bytes")
    if max(sizes) < 1 + least or (most is not None and 1 + most not in sizes):
        raise TableError(f"{where}: the fields do not fit the sizes")
    return layout


def _function(row: dict[str, Any], meanings: frozenset[str]) -> Function:
    where = f"function {row['number']:02X}h"
    answer = None
    if "answer" in row:
        deprecated = row.get("deprecated", False)
        answer_row = {**row["answer"], "number": row["number"] + ANSWER, "deprecated": deprecated}
        answer = _layout(answer_row, f"{where}, answer", meanings)
    return Function(row["name"], row["cite"], _layout(row, where, meanings), answer)


def _parameter(row: dict[str, Any], meanings: frozenset[str]) -> Parameter:
    where = f"parameter {row['name']}"
    made = {
        "of": tuple(row["of"]),
        "fields": _fields(row.get("fields", ()), where, meanings),
        "unconnected": tuple(row.get("unconnected", ())),
    }
    parameter = _build(Parameter, row, where, **made)
    for kind in parameter.of:
        _one_of(kind, KINDS, where)
    _one_of(parameter.form, FORMS, where)
    _one_of(parameter.access, ACCESS, where)
    if (parameter.form == "fields") != bool(parameter.fields):
        raise TableError(f"{where}: it has either fields or a form")
    return parameter


def _message(row: dict[str, Any], meanings: frozenset[str]) -> Message:
    where = f"message {row['number']:04X}h"
    rest = {key: value for key, value in row.items() if key != "from"}
    layouts = ("request", "success", "failure", "fields")
    made: dict[str, object] = {key: _fields(row[key], where, meanings) for key in layouts if key in row}
    made["coming"] = {key: _fields(texts, where, meanings) for key, texts in row.get("coming", {}).items()}
    made["sender"] = row.get("from", "host")
    if row.get("from", "host") == "host":
        made.setdefault("failure", (Field("error", "u8", "error"),))
        made["answer"] = row.get("answer", row["client"])
        if not {"request", "success"} <= row.keys():
            raise TableError(f"{where}: a message from the host has request and success")
    return _build(Message, rest, where, **made)


def _group(row: dict[str, Any]) -> Group:
    where = f"counters {row['name']}"
    prefix = row.get("c", "")
    counters = [
        _build(Counter, each, where, c=prefix + each["name"].upper() if prefix else each.get("c", ""))
        for each in row["counters"]
    ]
    _once((each.name for each in counters), where)
    return _build(Group, row, where, counters=tuple(counters))


def _parent(word: int) -> int:
    """The word without its last component that is not 0; 0 for a root."""
    for mask in (0xFFF0, 0xFF00, 0xF000):
        if word & ~mask & 0xFFFF:
            return word & mask
    return 0


def _profiles(rows: Mapping[str, dict[str, str]]) -> Iterator[Profile]:
    tree: dict[int, Profile] = {}
    for text, row in sorted(rows.items()):
        word = int(text, 16)
        parent = tree.get(_parent(word))
        if parent is None and _parent(word) & 0x0FFF:
            raise TableError(f"profile {text}: it has no parent")
        inherited = {} if parent is None else {key: getattr(parent, key) for key in INHERITED}
        tree[word] = _build(Profile, {**inherited, **row}, f"profile {text}", word=word)
    yield from tree.values()


def _check(table: Table) -> None:
    _once((numbers.id for numbers in table.sets), "sets")
    _once((name for name, _ in table.c_numbers()), "names in C")
    _once((each.number for function in table.functions for each in function.layouts), "functions")
    for kind in KINDS:
        mine = [parameter for parameter in table.parameters if kind in parameter.of]
        _once((parameter.number for parameter in mine), f"parameters of {kind}")
        _once((parameter.client for parameter in mine), f"parameters of {kind}")
    numbers: list[int] = []
    for message in table.messages:
        numbers += range(message.number, message.number + (3 if message.sender == "host" else 1))
        if message.number >> 8 not in table.message_groups:
            raise TableError(f"message {message.number:04X}h: it has no group")
    _once(numbers, "messages")
    if numbers != sorted(numbers):
        raise TableError("messages: they are not in the order of their numbers")
    _once((event.number for event in table.events), "events")
    if [group.number for group in table.counters] != list(range(len(table.counters))):
        raise TableError("counters: the groups are not numbered from 0 without gaps")
    _once((node.path for node in table.profiles), "profiles")


def parse(text: str) -> Table:
    """The table in a text. Raises TableError."""
    try:
        data = tomllib.loads(text)
        meanings = frozenset((*MEANINGS, *(row["id"] for row in data["sets"])))
        table = Table(
            version=data["version"],
            sets=tuple(_set(row) for row in data["sets"]),
            functions=tuple(_function(row, meanings) for row in data["functions"]),
            ranges=tuple(_build(Range, row, "ranges") for row in data["ranges"]),
            parameters=tuple(_parameter(row, meanings) for row in data["parameters"]),
            message_groups={int(number, 16): text for number, text in data["message_groups"].items()},
            messages=tuple(_message(row, meanings) for row in data["messages"]),
            events=tuple(
                _build(
                    Event,
                    {"client": row["name"], **row},
                    f"event {row['number']}",
                    fields=_fields(row["fields"], f"event {row['number']}", meanings),
                )
                for row in data["events"]
            ),
            counters=tuple(_group(row) for row in data["counters"]),
            profiles=tuple(_profiles(data["profiles"])),
        )
    except tomllib.TOMLDecodeError as error:
        raise TableError(str(error)) from None
    except KeyError as error:
        raise TableError(f"{error} is missing") from None
    _check(table)
    return table


def load(root: Path) -> Table:
    """The table of the repository at root. Raises TableError, and OSError where it cannot be read."""
    return parse((root / PLACE).read_text(encoding="utf-8"))
