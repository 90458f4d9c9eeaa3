"""A small client for the host API over UART (spec: host-api.md, [API]).

Bytes only: requests go out framed, answers come back checked; failure answers are exceptions. One request at a time.

    with Host("/dev/pts/3") as host:
        print(host.system_info())
        host.configure_link(Channel(Identity(2, 2, 4), 1), Channel(Identity(2, 2, 5), 2))
"""

import binascii
import struct
import time
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import NamedTuple, Self, TypeVar

import serial

SYNC = b"\xfe\x19"
HEADER = 8
BAUD_RATE = 128000  # a pseudo-terminal takes any

UNKNOWN_ID = 0x2200
SYSTEM_INFO = 0x2201
DEVICE_INFO = 0x2204
INPUT_INFO = 0x2207
OUTPUT_INFO = 0x220A
LINK_INFO = 0x220D
GET_PARAMETER = 0x2301
SET_PARAMETER = 0x2304
CONFIGURE_LINK = 0x2307

LINK_INACTIVE = 1
LINK_ACTIVE = 2

ERROR_NUMBER = 0x02
ERROR_NOT_READY = 0x0B

ERROR_MEANINGS = {
    0x01: "wrong payload size",
    0x02: "number out of range",
    0x03: "unknown device",
    0x04: "unknown channel or wrong direction",
    0x05: "device did not answer",
    0x06: "device refused",
    0x07: "busy",
    0x08: "sole access violated",
    0x09: "no free node id",
    0x0A: "bulk transfer failed",
    0x0B: "not ready, setup still running",
    0x0C: "CRC mismatch",
    0x0D: "storage failed",
    0x0E: "not supported",
    0x0F: "bad value",
}

T = TypeVar("T")


class HostError(Exception):
    """Something is wrong with an exchange."""


class NoAnswerError(HostError):
    """The arbitrator did not answer in time."""


class BadAnswerError(HostError):
    """What arrived is no well-formed answer to the request."""


class FailureError(HostError):
    """A failure answer; code is its error code (D-API-4), 0 for message 2200h."""

    def __init__(self, message: int, code: int) -> None:
        self.message = message
        self.code = code
        meaning = ERROR_MEANINGS.get(code, "unknown error") if code else "the arbitrator does not know this message"
        super().__init__(f"{message:04X}h: {meaning} ({code:02X}h)")


class Identity(NamedTuple):
    """Vendor, product and serial number of a device, 16 bits each."""

    vid: int
    pid: int
    sn: int

    def pack(self) -> bytes:
        return struct.pack("<HHH", *self)

    def __str__(self) -> str:
        return f"{self.vid:04X}:{self.pid:04X}:{self.sn:04X}"


class Channel(NamedTuple):
    """One channel of a device; number 0 is the device itself."""

    device: Identity
    number: int

    def pack(self) -> bytes:
        return self.device.pack() + bytes([self.number])

    def __str__(self) -> str:
        return f"{self.device}.{self.number}"


class Info(NamedTuple):
    """What 2205h, 2208h and 220Bh say of a device or a channel."""

    channel: Channel
    type: int
    profile: int


class Link(NamedTuple):
    """What 220Eh says of a link."""

    output: Channel
    input: Channel
    status: int


class SystemInfo(NamedTuple):
    """Counts of 2202h."""

    devices: int
    inputs: int
    outputs: int
    links: int


class Answer(NamedTuple):
    """A message from the arbitrator; payload is without its CRC16."""

    message: int
    reference: int
    payload: bytes


def crc8(data: bytes) -> int:
    """Polynomial 07h, initial 00h, not reflected (D-API-1)."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07 if crc & 0x80 else crc << 1) & 0xFF
    return crc


def crc16(data: bytes) -> int:
    """Polynomial 1021h, initial FFFFh, not reflected (D-API-1)."""
    return binascii.crc_hqx(data, 0xFFFF)


def encode(message: int, reference: int, payload: bytes = b"") -> bytes:
    """A whole message. The size counts the payload and its CRC16, or is 0."""
    size = struct.pack("<H", len(payload) + 2 if payload else 0)
    head = struct.pack("<HB", message, reference)
    tail = payload + struct.pack("<H", crc16(payload)) if payload else b""
    return SYNC + head + bytes([crc8(head + size)]) + size + tail


class Host:
    """One end of the serial line. Raises OSError when the port cannot be used."""

    def __init__(self, port: str, timeout_s: float = 4.0) -> None:
        """timeout_s: for one answer; the arbitrator needs 3 s at most (D-API-3)."""
        self._timeout_s = timeout_s
        self._reference = 0
        self._serial = serial.Serial(port, BAUD_RATE, timeout=timeout_s)

    def close(self) -> None:
        self._serial.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # --- messages ---

    def send_bytes(self, data: bytes) -> None:
        """Writes bytes as they are, right or wrong."""
        self._serial.write(data)

    def _read(self, count: int, deadline: float) -> bytes:
        self._serial.timeout = max(0.0, deadline - time.monotonic())
        data: bytes = self._serial.read(count)
        if len(data) != count:
            raise NoAnswerError(f"no answer in time ({len(data)} of {count} bytes: {data.hex(' ')})")
        return data

    def receive_bytes(self, timeout_s: float | None = None) -> bytes:
        """The next whole message, as it is on the wire; its checksums are not looked at."""
        deadline = time.monotonic() + (self._timeout_s if timeout_s is None else timeout_s)
        header = self._read(HEADER, deadline)
        if header[:2] != SYNC:
            raise BadAnswerError(f"no message begins with {header.hex(' ')}")
        return header + self._read(struct.unpack_from("<H", header, 6)[0], deadline)

    def receive(self, timeout_s: float | None = None) -> Answer:
        """The next message, whatever it is; its checksums must be right."""
        data = self.receive_bytes(timeout_s)
        message, reference = struct.unpack_from("<HB", data, 2)
        payload = data[HEADER:-2] if len(data) > HEADER else b""
        if data != encode(message, reference, payload):
            raise BadAnswerError(f"wrong checksum or size: {data.hex(' ')}")
        return Answer(message, reference, payload)

    def request(self, message: int, payload: bytes = b"") -> bytes:
        """Sends a request and returns the payload of its success answer. Raises FailureError otherwise."""
        self._reference = self._reference % 255 + 1  # 0 belongs to unasked messages
        self.send_bytes(encode(message, self._reference, payload))
        deadline = time.monotonic() + self._timeout_s
        while True:
            answer = self.receive(deadline - time.monotonic())
            if answer.reference == self._reference:
                break  # others answer requests that were given up before
        if answer.message == message + 1:
            return answer.payload
        if answer.message == UNKNOWN_ID:
            raise FailureError(message, 0)
        if answer.message == message + 2 and len(answer.payload) == 1:
            raise FailureError(message, answer.payload[0])
        raise BadAnswerError(f"{message:04X}h was answered by {answer.message:04X}h {answer.payload.hex(' ')}")

    # --- tables ---

    def system_info(self) -> SystemInfo:
        return SystemInfo(*self._request_unpacked(SYSTEM_INFO, b"", "<BBBB"))

    def device(self, number: int) -> Info:
        return self._info(DEVICE_INFO, number)

    def input(self, number: int) -> Info:
        return self._info(INPUT_INFO, number)

    def output(self, number: int) -> Info:
        return self._info(OUTPUT_INFO, number)

    def link(self, number: int) -> Link:
        fields = self._request_unpacked(LINK_INFO, bytes([number]), "<HHHBHHHBB")
        return Link(Channel(Identity(*fields[0:3]), fields[3]), Channel(Identity(*fields[4:7]), fields[7]), fields[8])

    def devices(self) -> list[Info]:
        return list(_all(self.device))

    def inputs(self) -> list[Info]:
        return list(_all(self.input))

    def outputs(self) -> list[Info]:
        return list(_all(self.output))

    def links(self) -> list[Link]:
        return list(_all(self.link))

    def _request_unpacked(self, message: int, payload: bytes, layout: str) -> tuple[int, ...]:
        answer = self.request(message, payload)
        if len(answer) != struct.calcsize(layout):
            raise BadAnswerError(f"{message + 1:04X}h has {len(answer)} bytes: {answer.hex(' ')}")
        return struct.unpack(layout, answer)

    def _info(self, message: int, number: int) -> Info:
        vid, pid, sn, index, kind, profile = self._request_unpacked(message, bytes([number]), "<HHHBHH")
        return Info(Channel(Identity(vid, pid, sn), index), kind, profile)

    # --- devices ---

    def get_parameter(self, channel: Channel, parameter: int) -> bytes:
        return self.request(GET_PARAMETER, channel.pack() + bytes([parameter]))

    def set_parameter(self, channel: Channel, parameter: int, value: bytes) -> None:
        self.request(SET_PARAMETER, channel.pack() + bytes([parameter]) + value)

    def configure_link(self, output: Channel, input_: Channel) -> int:
        """Makes a link and returns its status."""
        (status,) = self._request_unpacked(CONFIGURE_LINK, output.pack() + input_.pack(), "<B")
        return status


def _all(get: Callable[[int], T]) -> Iterator[T]:
    """Entry after entry of a numbered table, until the arbitrator says that the number is out of range."""
    for number in range(1, 256):
        try:
            yield get(number)
        except FailureError as error:
            if error.code == ERROR_NUMBER:
                return
            raise
