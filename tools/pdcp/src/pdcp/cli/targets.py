"""How devices and channels are named on the command line."""

import re
from typing import NoReturn

from ..client import Client
from ..errors import ErrorCode, RequestError
from ..model import Channel, ChannelId, Device, Direction, Identity, parse_number
from .common import CommandError, UsageFault

DEVICE_HELP = "VID:PID:SN, or the device's number in the list (#2, or just 2)."
TARGET_HELP = "A device (2:2:4 or #1) or a channel (2:2:4.1, #1.1, or in#3, out#2 of the lists)."
OUTPUT_HELP = "VID:PID:SN.INDEX, its number in 'pdcp outputs' (#2), or DEVICE.INDEX (#1.2)."
INPUT_HELP = "VID:PID:SN.INDEX, its number in 'pdcp inputs' (#2), or DEVICE.INDEX (#1.2)."
EPILOG = (
    "Devices are named VID:PID:SN and channels VID:PID:SN.INDEX, each number decimal or, with 0x, hexadecimal: 2:2:4, "
    "0x1234:0x10:7.1. Or by their number in the list, #3: quote that, '#3', because a shell takes # for a comment; "
    "a plain 3 means the same."
)

_NUMBER = re.compile(r"#?(\d+)")
_OF_DEVICE = re.compile(r"#?(\d+)\.(\w+)")
_OF_LIST = re.compile(r"(in|out)#?(\d+)")


def device(client: Client, text: str) -> Identity:
    """A device argument. A number is looked up in the list."""
    number = _NUMBER.fullmatch(text)
    if number:
        return _device(client, int(number[1])).identity
    return _identity(text)


def output(client: Client, text: str) -> ChannelId:
    return _channel(client, text, Direction.OUTPUT)


def input_(client: Client, text: str) -> ChannelId:
    return _channel(client, text, Direction.INPUT)


def any_target(client: Client, text: str) -> ChannelId:
    """A device or a channel of either direction."""
    listed = _OF_LIST.fullmatch(text)
    if listed:
        direction = Direction.INPUT if listed[1] == "in" else Direction.OUTPUT
        return _listed(client, int(listed[2]), direction).id
    number = _NUMBER.fullmatch(text)
    if number:
        return _device(client, int(number[1])).id
    return _of_device(client, text) or _channel_id(text)


def _channel(client: Client, text: str, direction: Direction) -> ChannelId:
    number = _NUMBER.fullmatch(text)
    if number:
        return _listed(client, int(number[1]), direction).id
    found = _of_device(client, text) or _channel_id(text)
    if found.index == 0:
        raise UsageFault(f"'{text}' is a device, not a channel: write {text}.INDEX")
    return found


def _of_device(client: Client, text: str) -> ChannelId | None:
    """DEVICE.INDEX with a number from the list."""
    match = _OF_DEVICE.fullmatch(text)
    if not match:
        return None
    try:
        index = parse_number(match[2])
    except ValueError as error:
        raise UsageFault(str(error)) from None
    return ChannelId(_device(client, int(match[1])).identity, index)


def _identity(text: str) -> Identity:
    try:
        return Identity.parse(text)
    except ValueError as error:
        raise UsageFault(f"{error}; a device is VID:PID:SN or #NUMBER") from None


def _channel_id(text: str) -> ChannelId:
    try:
        return ChannelId.parse(text)
    except ValueError as error:
        raise UsageFault(f"{error}; a channel is VID:PID:SN.INDEX or #NUMBER") from None


def _device(client: Client, number: int) -> Device:
    _check(number, "device")
    try:
        return client.device(number)
    except RequestError as error:
        _missing(error, number, "device")


def _listed(client: Client, number: int, direction: Direction) -> Channel:
    _check(number, direction)
    try:
        return client.input(number) if direction is Direction.INPUT else client.output(number)
    except RequestError as error:
        _missing(error, number, direction)


def _check(number: int, what: str) -> None:
    if not 1 <= number <= 255:
        raise UsageFault(f"there can be no {what} #{number}")


def _missing(error: RequestError, number: int, what: str) -> NoReturn:
    if error.code == ErrorCode.OUT_OF_RANGE:
        raise CommandError(f"there is no {what} #{number}; 'pdcp {what}s' lists them") from None
    raise error
