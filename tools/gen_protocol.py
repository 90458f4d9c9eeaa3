#!/usr/bin/env python3
"""Writes what is generated from docs/spec/protocol.toml.

    gen_protocol.py                 the Python modules of tools/pdcp
    gen_protocol.py --check         only says which of them are not up to date
    gen_protocol.py --header FILE   the C header of tests/unit/test_protocol_table.c

Exit status: 0 done or up to date, 1 not up to date, 2 the table is not sound or cannot be read.
"""

import argparse
import json
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields
from itertools import groupby
from pathlib import Path

from protocol_table import (
    KINDS,
    Field,
    Function,
    Message,
    NumberSet,
    Parameter,
    Table,
    TableError,
    built,
    load,
    sizes_of,
)

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = Path("tools/pdcp/src/pdcp")
HEAD = "generated from docs/spec/protocol.toml by tools/gen_protocol.py; do not edit"
WIDTH = 120


# --- Python ---------------------------------------------------------------------------------------


class Hex(int):
    """A number that is written in hexadecimal."""

    digits = 2

    def __repr__(self) -> str:
        return f"0x{int(self):0{self.digits}X}"


class Hex4(Hex):
    digits = 4


def one_line(value: object) -> str:
    """A value as it stands in a program, tuples and dictionaries on one line."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, tuple):
        inner = ", ".join(one_line(each) for each in value)
        return f"({inner},)" if len(value) == 1 else f"({inner})"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{one_line(key)}: {one_line(each)}" for key, each in value.items()) + "}"
    return repr(value)


def assign(target: str, value: object, indent: str = "", end: str = "") -> Iterator[str]:
    """Lines that begin with target; what is too long for a line is broken, an item a line."""
    line = f"{indent}{target}{one_line(value)}{end}"
    if len(line) <= WIDTH or not isinstance(value, tuple | dict):
        yield line
    elif isinstance(value, tuple):
        yield f"{indent}{target}("
        for each in value:
            yield from assign("", each, f"{indent}    ", ",")
        yield f"{indent}){end}"
    else:
        yield f"{indent}{target}{{"
        for key, each in value.items():
            yield from assign(f"{one_line(key)}: ", each, f"{indent}    ", ",")
        yield f"{indent}}}{end}"


def cited(text: str, cite: str) -> str:
    """A text with what it cites, decisions in brackets."""
    clauses = re.findall(r"\[[^]]*\]", cite)
    decisions = ", ".join(re.findall(r"D-[A-Z]+-\d+", cite))
    return " ".join([text, *clauses, *([f"({decisions})"] if decisions else [])])


def member(name: str, number: int, text: str) -> str:
    """A member of an enumeration, with its text where that says more."""
    return f"    {name} = {number!r}" + ("" if text == name.lower().replace("_", " ") else f"  # {text}")


def enumeration(numbers: NumberSet) -> Iterator[str]:
    values = [value for value in built(numbers.values) if value.client]
    yield f"class {numbers.client}({'IntFlag' if numbers.flags else 'IntEnum'}):"
    yield f'    """{cited(numbers.text, numbers.cite)}."""'
    yield ""
    for value in values:
        number = Hex(value.number) if numbers.flags or numbers.id == "error" else value.number
        yield member(value.client, number, value.text)


def function_codes(functions: Sequence[Function]) -> Iterator[str]:
    yield "class FunctionCode(IntEnum):"
    yield '    """Function codes of requests; an answer has 80h more [PDCP 3.1]."""'
    yield ""
    for function in functions:
        yield f"    {function.name} = {Hex(function.request.number)!r}"


def event_kinds(table: Table) -> Iterator[str]:
    yield "class EventKind(IntEnum):"
    yield '    """Kinds of events; bit kind - 1 of the mask asks for one (2416h, 2419h)."""'
    yield ""
    for event in built(table.events):
        yield member(event.client, event.number, event.text)
    yield ""
    yield "    @property"
    yield "    def mask(self) -> int:"
    yield "        return 1 << (self - 1)"


def function_rows(functions: Sequence[Function]) -> tuple[object, ...]:
    layouts = sorted((each for function in functions for each in function.layouts), key=lambda each: each.number)
    return tuple(
        (
            Hex(each.number),
            each.text,
            (*each.dlc, *each.also),
            tuple((part.name, part.most or 0) for part in each.fields),
            each.senders,
            each.deprecated,
        )
        for each in layouts
    )


STYLES = {"ms": "milliseconds", "": "number"}
SAME_STYLES = ("node", "word", "type", "profile", "switch", "transfer")


def style(part: Field) -> str:
    return part.meaning if part.meaning in SAME_STYLES else STYLES.get(part.meaning, "number")


def parameter_rows(parameters: Iterable[Parameter]) -> tuple[object, ...]:
    known = sorted(built(parameters), key=lambda each: each.number)
    return tuple(
        (kind, each.number, each.client, tuple((part.name, part.most, style(part)) for part in each.fields), each.form)
        for kind in KINDS
        for each in known
        if kind in each.of
    )


def protocol_module(table: Table) -> Iterator[str]:
    yield f"# {HEAD}"
    yield '"""Numbers of the protocol and tables of its codes, parameters and counters."""'
    yield ""
    yield "from enum import IntEnum, IntFlag"
    yield ""
    yield f"VERSION = {table.version}  # of the host API"
    for numbers in built(table.sets):
        if not numbers.client:
            for value in (each for each in built(numbers.values) if each.client):
                yield f"{value.client} = {value.number}  # {cited(value.text, value.cite)}"
    classes = [numbers for numbers in built(table.sets) if numbers.client]
    for lines in (
        *(enumeration(numbers) for numbers in classes),
        function_codes(table.functions),
        event_kinds(table),
    ):
        yield from ("", "", *lines)
    yield ""
    yield ""
    yield "# What the members of the enumerations mean, by the ids of their sets."
    texts = {
        numbers.id: {each.number: each.text for each in built(numbers.values) if each.client} for numbers in classes
    }
    yield from assign("TEXTS: dict[str, dict[int, str]] = ", texts)
    yield ""
    yield "# Code, name, sizes, fields with their bytes (0: all that is left), who sends it, is it deprecated."
    yield "FunctionRow = tuple[int, str, tuple[int, ...], tuple[tuple[str, int], ...], tuple[str, ...], bool]"
    yield from assign("FUNCTIONS: tuple[FunctionRow, ...] = ", function_rows(table.functions))
    yield ""
    yield "# First and last code, name."
    ranges = tuple((Hex(each.first), Hex(each.last), each.text) for each in table.ranges)
    yield from assign("CODE_RANGES: tuple[tuple[int, int, str], ...] = ", ranges)
    yield ""
    yield "# Kind, number, name, fields with their bytes and how they are shown, form."
    yield "ParameterRow = tuple[str, int, str, tuple[tuple[str, int, str], ...], str]"
    yield from assign("PARAMETERS: tuple[ParameterRow, ...] = ", parameter_rows(table.parameters))
    yield ""
    yield "# Of an input that is not connected, by parameter."
    unconnected = {each.number: each.unconnected for each in built(table.parameters) if each.unconnected}
    yield from assign("NO_SOURCE: dict[int, tuple[int, ...]] = ", unconnected)
    yield ""
    yield "# Groups in their order: name, then name and meaning of each counter."
    groups = tuple((group.client, tuple((each.name, each.text) for each in group.counters)) for group in table.counters)
    yield from assign("COUNTERS: tuple[tuple[str, tuple[tuple[str, str], ...]], ...] = ", groups)


PYTHON_TYPES = {
    "u8": "U8",
    "u16": "U16",
    "u32": "U32",
    "dev": "Dev",
    "chan": "Chan",
    "mask": "Mask",
    "bytes8": "Octets",
    "bytes": "Rest",
    "bytes+": "Value",
    "u32*": "U32s",
}


def message_class(head: str, text: str, layout: Sequence[Field]) -> Iterator[str]:
    yield from ("", "", "@dataclass(frozen=True)", f"class {head}:")
    if text:
        yield f'    """{text}."""'
    if text and layout:
        yield ""
    for each in layout:
        yield f"    {each.name}: {PYTHON_TYPES[each.type]}"
    if not text and not layout:
        yield "    pass"


def message_classes(message: Message) -> Iterator[str]:
    number, text = message.number, cited(message.text, message.cite)
    if message.sender == "arbitrator":
        yield from message_class(f"{message.client}(Message, id=0x{number:04X})", text, message.fields)
        return
    success, failure = f"{message.answer}Success", f"{message.answer}Failure"
    reads = ", reads=True" if message.reads else ""
    yield from message_class(f'{message.client}(Request["{success}"], id=0x{number:04X}{reads})', text, message.request)
    yield from message_class(f"{success}(Message, id=0x{number + 1:04X})", "", message.success)
    if [each.name for each in message.failure] == ["error"]:
        yield from ("", "", f"class {failure}(Failure, id=0x{number + 2:04X}):", "    pass")
    else:
        head = f"{failure}(Message, id=0x{number + 2:04X})"
        yield from message_class(head, message.failure_text, message.failure)


def message_names(message: Message) -> tuple[str, ...]:
    if message.sender == "arbitrator":
        return (message.client,)
    return (message.client, f"{message.answer}Success", f"{message.answer}Failure")


LAYOUTS = ("request", "success", "failure", "fields")


def messages_module(table: Table) -> Iterator[str]:
    messages = list(built(table.messages))
    used = {PYTHON_TYPES[each.type] for message in messages for part in LAYOUTS for each in getattr(message, part)}
    base = ("MESSAGES", "Failure", "FormatError", "Message", "Request", "unpack")
    numbers = ("MESSAGES", "U8", "U16", "U32")  # in the order that ruff wants
    yield f"# {HEAD}"
    yield '"""The messages of the host API [API 3.2, 3.3], and the extension group 24xxh (D-API-5).'
    yield ""
    yield "Each message is a dataclass whose fields are its payload, in the order of the wire (payload.py). The success"
    yield 'answer of request n is n + 1, its failure answer n + 2."""'
    yield ""
    yield "from dataclasses import dataclass"
    yield ""
    yield "from .payload import ("
    for name in (*numbers, *sorted({*base, *used} - {*numbers})):
        yield f"    {name},"
    yield ")"
    yield ""
    names = sorted({*base, *(name for message in messages for name in message_names(message))})
    yield "__all__ = ["
    yield from (f'    "{name}",' for name in names)
    yield "]"
    for group, members in groupby(messages, key=lambda message: message.number >> 8):
        yield from ("", f"# --- {group:02X}xxh: {table.message_groups[group]} ---")
        for message in members:
            yield from message_classes(message)
        yield ""


def filled(items: Sequence[str], indent: str) -> Iterator[str]:
    """A tuple of items, as many on a line as find room."""
    line = f"{indent}({items[0]},"
    for item in items[1:]:
        if len(line) + len(item) + 4 > WIDTH:
            yield line
            line = f"{indent} {item},"
        else:
            line += f" {item},"
    yield f"{line[:-1]}),"


def profiles_module(table: Table) -> Iterator[str]:
    yield f"# {HEAD}"
    yield '"""The reference tree of channel profiles (docs/profiles.md)."""'
    yield ""
    yield "# Word, path, name, what its values mean, scale, mode, sign, rate, what is safe."
    yield "PROFILES: tuple[tuple[int, str, str, str, str, str, str, str, str], ...] = ("
    for node in table.profiles:
        row = (Hex4(node.word), *(getattr(node, each.name) for each in fields(node)[1:]))
        yield from filled([one_line(each) for each in row], "    ")
    yield ")  # fmt: skip"


MODULES: dict[str, Callable[[Table], Iterator[str]]] = {
    "messages.py": messages_module,
    "profile_tree.py": profiles_module,
    "protocol.py": protocol_module,
}


def text_of(lines: Iterable[str]) -> str:
    return "\n".join(lines).rstrip("\n") + "\n"


# --- C --------------------------------------------------------------------------------------------


def macro(name: str, arguments: str, rows: Iterable[Sequence[object]]) -> Iterator[str]:
    """A macro that calls another with each row."""
    yield ""
    yield f"/* X({arguments}) */"
    yield f"#define {name}(X) \\"
    lines = [f"    X({', '.join(str(each) for each in row)})" for row in rows]
    yield " \\\n".join(lines)


def bits(sizes: Sequence[int]) -> int:
    return sum(1 << size for size in sizes)


def field_rows(table: Table) -> Iterator[tuple[object, ...]]:
    """The fields of function codes whose place is fixed and that are there in the sizes of [PDCP 3.2]."""
    for function in table.functions:
        for each in function.layouts:
            at = 1
            for part in each.fields:
                if at + part.least <= max(each.dlc):
                    yield Hex(each.number), f'"{part.name}"', at, part.most or 0
                at += part.least


def unconnected_rows(table: Table) -> Iterator[tuple[object, ...]]:
    for parameter in (each for each in built(table.parameters) if each.unconnected):
        value = b"".join(
            number.to_bytes(part.least, "little")
            for part, number in zip(parameter.fields, parameter.unconnected, strict=True)
        )
        yield from ((parameter.number, place, f"0x{byte:02X}") for place, byte in enumerate(value))


def open_size(layout: Sequence[Field]) -> tuple[int, int]:
    least, most = sizes_of(layout)
    return least, 0xFFFF if most is None else most


def header(table: Table) -> Iterator[str]:
    layouts = [each for function in table.functions for each in function.layouts]
    parameters = [(KINDS.index(kind), each) for each in built(table.parameters) for kind in each.of]
    yield f"/* {HEAD} */"
    yield "#ifndef PROTOCOL_TABLE_H"
    yield "#define PROTOCOL_TABLE_H"
    yield from macro("PROTOCOL_NUMBERS", "constant, number", table.c_numbers())
    yield from macro(
        "PROTOCOL_FUNCTIONS",
        "code; sizes of [PDCP 3.2], others accepted, bit n: n bytes; from device, arbitrator; to all; deprecated",
        (
            (
                Hex(each.number),
                f"0x{bits(each.dlc):03X}",
                f"0x{bits(each.also):03X}",
                int("device" in each.senders),
                int("arbitrator" in each.senders),
                int(each.to_all),
                int(each.deprecated),
            )
            for each in layouts
        ),
    )
    yield from macro(
        "PROTOCOL_FIELDS", "code, name, place in the data, bytes or 0: all that is left", field_rows(table)
    )
    yield from macro(
        "PROTOCOL_PARAMETERS",
        "0 device, 1 input, 2 output; number; bytes or 0: any; is it written; does a setup fail without it",
        (
            (kind, each.number, sizes_of(each.fields)[0], int(each.access != "read"), int(each.mandatory))
            for kind, each in parameters
        ),
    )
    yield from macro("PROTOCOL_UNCONNECTED", "parameter of an input, place in its value, byte", unconnected_rows(table))
    yield from macro(
        "PROTOCOL_MESSAGES",
        "id; bytes of a request's payload, least and most; the same of its success answer",
        (
            (f"0x{each.number:04X}", *open_size(each.request), *open_size(each.success))
            for each in built(table.messages)
            if each.sender == "host"
        ),
    )
    yield from macro(
        "PROTOCOL_EVENTS",
        "kind; bytes of its data, least and most",
        ((each.number, *open_size(each.fields)) for each in built(table.events)),
    )
    yield from macro(
        "PROTOCOL_COUNTERS",
        "group, place in it, name",
        (
            (group.number, place, f'"{each.name}"')
            for group in table.counters
            for place, each in enumerate(group.counters)
        ),
    )
    yield ""
    yield "#endif"


# --- program --------------------------------------------------------------------------------------


def main() -> int:
    parser = argparse.ArgumentParser(description="Writes what is generated from docs/spec/protocol.toml.")
    parser.add_argument("--root", type=Path, default=ROOT, help=argparse.SUPPRESS)
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--check", action="store_true", help="write nothing, say what is not up to date")
    what.add_argument("--header", type=Path, metavar="FILE", help="write the C header of the tests instead")
    arguments = parser.parse_args()
    try:
        table = load(arguments.root)
    except (TableError, OSError) as error:
        print(f"docs/spec/protocol.toml: {error}", file=sys.stderr)
        return 2
    if arguments.header:
        arguments.header.write_text(text_of(header(table)), encoding="utf-8")
        return 0
    status = 0
    for name, module in MODULES.items():
        path = arguments.root / PACKAGE / name
        text = text_of(module(table))
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        if arguments.check:
            print(f"{PACKAGE / name}: not up to date, run tools/gen_protocol.py")
            status = 1
        else:
            path.write_text(text, encoding="utf-8")
    return status


if __name__ == "__main__":
    sys.exit(main())
