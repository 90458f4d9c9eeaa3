"""A client that can also send and receive whole messages, right or wrong, as they are on the wire."""

import struct
import time

from programs import LINE_TIMEOUT_S

from pdcp import Client
from pdcp.errors import NoAnswerError
from pdcp.transport import SerialTransport
from pdcp.wire import HEADER_SIZE, SYNC, Frame, encode


class RawHost(Client):
    """Raw messages and those of Client go one after the other: what is raw is not matched to any request."""

    def __init__(self, port: str, timeout_s: float = LINE_TIMEOUT_S) -> None:
        self._line = SerialTransport(port)
        self._raw_timeout_s = timeout_s
        super().__init__(self._line, timeout_s=timeout_s)

    def send_bytes(self, data: bytes) -> None:
        self._line.write(data)

    def _read(self, count: int, deadline_s: float) -> bytes:
        data = b""
        while len(data) < count:
            piece = self._line.read_at_most(count - len(data), deadline_s - time.monotonic())
            if not piece:
                raise NoAnswerError(f"no answer in time ({len(data)} of {count} bytes: {data.hex(' ')})")
            data += piece
        return data

    def receive_bytes(self, timeout_s: float | None = None) -> bytes:
        """The next whole message; its checksums are not looked at."""
        deadline_s = time.monotonic() + (self._raw_timeout_s if timeout_s is None else timeout_s)
        header = self._read(HEADER_SIZE, deadline_s)
        assert header[:2] == SYNC, f"no message begins with {header.hex(' ')}"
        size: int = struct.unpack_from("<H", header, 6)[0]
        return header + self._read(size, deadline_s)

    def receive(self, timeout_s: float | None = None) -> Frame:
        """The next message, whatever it is; its checksums must be right."""
        data = self.receive_bytes(timeout_s)
        message, reference = struct.unpack_from("<HB", data, 2)
        frame = Frame(message, reference, data[HEADER_SIZE:-2] if len(data) > HEADER_SIZE else b"")
        assert data == encode(*frame), f"wrong checksum or size: {data.hex(' ')}"
        return frame
