"""An arbitrator that says what a test tells it to, at the other end of a real pseudo-terminal."""

import os
import threading
import tty
from collections.abc import Callable

from pdcp.wire import Frame, Receiver, encode

Script = Callable[[Frame], list[Frame]]  # a request, and what is sent for it


class ScriptedArbitrator:
    """The other end of a pseudo-terminal. Answers each request with what its script says."""

    def __init__(self, script: Script) -> None:
        self.requests: list[Frame] = []
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self._script = script
        self._unplugged = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def send(self, data: bytes) -> None:
        """Bytes that nobody asked for."""
        os.write(self._master, data)

    def unplug(self) -> None:
        """For scripts: after this request the line is gone, as when the daemon ends."""
        self._unplugged = True

    def _run(self) -> None:
        receiver = Receiver()
        try:
            while not self._unplugged:
                # Fails once nobody has the other end open.
                for frame in receiver.on_bytes(os.read(self._master, 4096), 0.0):
                    self.requests.append(frame)
                    for answer in self._script(frame):
                        os.write(self._master, encode(*answer))
        except OSError:
            pass
        os.close(self._master)

    def close(self) -> None:
        os.close(self._slave)
        self._thread.join()
