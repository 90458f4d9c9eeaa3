"""An emulated USB CAN adapter: gs_usb_gadget as a USB device of this machine's own (FunctionFS on dummy_hcd).

Needs root, the modules usb_f_fs and dummy_hcd, and configfs; one adapter at a time.
"""

import json
import os
import socket
from contextlib import ExitStack, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from programs import Program, until

from tests.vm.bench import DEADLINE_S, INTERFACE, run

CONFIGFS = Path("/sys/kernel/config")
GADGET = CONFIGFS / "usb_gadget/pdcp"
UDC = "dummy_udc.0"
LANGUAGE = "strings/0x409"
SERIAL = "0031002A4E53"


def load_host() -> None:
    """A USB host of full speed, which is that of real adapters, with one place to plug one in."""
    run("modprobe", "dummy_hcd", "is_high_speed=0")
    if not (CONFIGFS / "usb_gadget").exists():
        run("mount", "-t", "configfs", "none", CONFIGFS)


def write(path: Path, text: str) -> None:
    path.write_text(f"{text}\n", encoding="ascii")


class Adapter:
    """The adapter, plugged in, its CAN side on vcan0. options are those of gs_usb_gadget."""

    def __init__(self, programs: Path, folder: Path, *options: str, plugged: bool = True) -> None:
        self._commands = folder / "commands"
        with ExitStack() as stack:
            functions = self._make_gadget(stack, folder)
            self.program = stack.enter_context(
                Program([programs / "gs_usb_gadget", functions, INTERFACE, self._commands, *options])
            )
            self.program.line("ready", DEADLINE_S)
            self._socket = stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
            self._socket.bind(str(folder / "answers"))
            self._socket.settimeout(DEADLINE_S)
            stack.callback(self._unplug_at_the_end)
            if plugged:
                self.plug()
            self._stack = stack.pop_all()

    @staticmethod
    def _make_gadget(stack: ExitStack, folder: Path) -> Path:
        """Describes the device to the kernel. Returns the folder of its endpoints."""

        def make(name: str) -> Path:
            path = GADGET / name
            path.mkdir()
            stack.callback(os.rmdir, path)  # of configfs: what is in it does not count
            return path

        def mount(*words: str | Path) -> None:
            run("mount", *words)
            stack.callback(run, "umount", words[-1])

        load_host()
        strings = [make(name) for name in (".", LANGUAGE)][1]
        write(GADGET / "idVendor", "0x1d50")
        write(GADGET / "idProduct", "0x606f")
        write(strings / "serialnumber", SERIAL)
        write(strings / "product", "emulated adapter")
        function, configuration = make("functions/ffs.adapter"), make("configs/c.1")
        link = configuration / function.name
        link.symlink_to(function)
        stack.callback(link.unlink)
        endpoints = folder / "endpoints"
        endpoints.mkdir()
        mount("-t", "functionfs", "adapter", endpoints)
        return endpoints

    def _unplug_at_the_end(self) -> None:
        if self.is_plugged():
            self.unplug()

    def plug(self) -> None:
        """Returns when the host has found the device."""
        write(GADGET / "UDC", UDC)
        until(self.is_plugged, "the adapter is on the USB bus", DEADLINE_S)

    def unplug(self) -> None:
        write(GADGET / "UDC", "")
        until(lambda: not self.is_plugged(), "the adapter is off the USB bus", DEADLINE_S)

    @staticmethod
    def is_plugged() -> bool:
        for path in Path("/sys/bus/usb/devices").glob("*/serial"):
            with suppress(OSError):
                if path.read_text(encoding="ascii").strip() == SERIAL and any(path.parent.glob("*:1.0")):
                    return True
        return False

    def ask(self, command: str = "report") -> dict[str, Any]:
        """Tells the adapter to do something and returns its counters."""
        self._socket.sendto(command.encode("ascii"), str(self._commands))
        report: dict[str, Any] = json.loads(self._socket.recv(4096))
        return report

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()
