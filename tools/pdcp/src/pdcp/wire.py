"""Messages in a stream of bytes [API 3.1]: framing, checksums, and a receiver that finds its way back from anything.

    FEh 19h | id LSB, MSB | reference | CRC8 | size LSB, MSB | payload ... | CRC16 LSB, MSB

size counts the payload and its CRC16; 0 means that neither is there.
"""

import binascii
import struct
from typing import NamedTuple

from .protocol import CRC16_SIZE, HEADER_SIZE, PAYLOAD_MAX, SYNC1, SYNC2

__all__ = ["CRC16_SIZE", "HEADER_SIZE", "PAYLOAD_MAX", "SYNC", "Frame", "Receiver", "crc16", "crc8", "encode"]

SYNC = bytes((SYNC1, SYNC2))
SILENCE_S = 0.1  # inside a message: it is given up (D-API-2)


class Frame(NamedTuple):
    """A message; payload is without its CRC16."""

    message: int
    reference: int
    payload: bytes = b""


def _crc8_table() -> bytes:
    table = bytearray(256)
    for value in range(256):
        crc = value
        for _ in range(8):
            crc = (crc << 1 ^ 0x07 if crc & 0x80 else crc << 1) & 0xFF
        table[value] = crc
    return bytes(table)


_CRC8_TABLE = _crc8_table()


def crc8(data: bytes | bytearray) -> int:
    """Polynomial 07h, initial 00h, not reflected (D-API-1)."""
    crc = 0
    for byte in data:
        crc = _CRC8_TABLE[crc ^ byte]
    return crc


def crc16(data: bytes) -> int:
    """Polynomial 1021h, initial FFFFh, not reflected (D-API-1)."""
    return binascii.crc_hqx(data, 0xFFFF)


def encode(message: int, reference: int, payload: bytes = b"") -> bytes:
    """A whole message. Raises ValueError when the payload is too long for any arbitrator."""
    if len(payload) > PAYLOAD_MAX:
        raise ValueError(f"a payload of {len(payload)} bytes is longer than {PAYLOAD_MAX}")
    size = struct.pack("<H", len(payload) + CRC16_SIZE if payload else 0)
    head = struct.pack("<HB", message, reference)
    tail = payload + struct.pack("<H", crc16(payload)) if payload else b""
    return SYNC + head + bytes([crc8(head + size)]) + size + tail


class Receiver:
    """Takes bytes as they come and hands out messages whose checksums are right.

    Whatever turns out to be no message is given up from its first byte on, and the bytes behind that are looked at
    again, so that a message right behind garbage, or swallowed by a cut one, is found (D-API-2). Times are seconds of
    any clock that does not go back.
    """

    def __init__(self) -> None:
        self.skipped = 0  # bytes that belonged to no message
        self.bad_checksums = 0
        self._buffer = bytearray()
        self._last_s = 0.0

    @property
    def next_s(self) -> float | None:
        """When on_time has something to do; None: not before more bytes come."""
        return self._last_s + SILENCE_S if self._buffer else None

    def on_bytes(self, data: bytes, now_s: float) -> list[Frame]:
        """Returns the messages that are complete now."""
        frames = self.on_time(now_s)
        if data:
            self._buffer += data
            self._last_s = now_s
            frames += self._take_all()
        return frames

    def on_time(self, now_s: float) -> list[Frame]:
        """Gives up a message that has been silent for too long; others may be inside it."""
        frames: list[Frame] = []
        while self._buffer and now_s >= self._last_s + SILENCE_S:
            self._skip()
            frames += self._take_all()
        return frames

    def _skip(self) -> None:
        """Drops bytes up to the next that may begin a message."""
        at = self._buffer.find(SYNC[0], 1)
        count = len(self._buffer) if at < 0 else at
        self.skipped += count
        del self._buffer[:count]

    def _take_all(self) -> list[Frame]:
        frames: list[Frame] = []
        while self._buffer:
            size = self._size()
            if size is None:
                self._skip()
            elif size > len(self._buffer):
                break
            else:
                frame = self._frame(size)
                if frame is None:
                    self.bad_checksums += 1
                    self._skip()
                else:
                    frames.append(frame)
                    del self._buffer[:size]
        return frames

    def _size(self) -> int | None:
        """How many bytes the message at the front has, as far as is known; None: there is no message."""
        buffer = self._buffer
        if not SYNC.startswith(buffer[:2]):
            return None
        if len(buffer) < HEADER_SIZE:
            return HEADER_SIZE
        if crc8(buffer[2:5] + buffer[6:8]) != buffer[5]:
            self.bad_checksums += 1
            return None
        size: int = struct.unpack_from("<H", buffer, 6)[0]
        if 0 < size <= CRC16_SIZE or size > PAYLOAD_MAX + CRC16_SIZE:
            return None
        return HEADER_SIZE + size

    def _frame(self, size: int) -> Frame | None:
        """Takes the message at the front apart; None: its CRC16 is wrong."""
        message, reference = struct.unpack_from("<HB", self._buffer, 2)
        payload = bytes(self._buffer[HEADER_SIZE : max(HEADER_SIZE, size - CRC16_SIZE)])
        if payload and crc16(payload) != struct.unpack_from("<H", self._buffer, size - CRC16_SIZE)[0]:
            return None
        return Frame(message, reference, payload)
