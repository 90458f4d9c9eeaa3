"""The simulated bus of a pdcpd, through python-can's client of socketcand."""

import time

import can
from programs import LINE_TIMEOUT_S


def open_sim_bus(port: int) -> can.BusABC:
    """A client of the bus at this TCP port.

    python-can takes a frame that comes together with the last `< ok >` for a part of it. The server holds frames back
    for a while (D-SIM-2); a client that was kept waiting for longer is opened again."""
    deadline_s = time.monotonic() + LINE_TIMEOUT_S
    while True:
        try:
            return can.Bus(interface="socketcand", host="127.0.0.1", port=port, channel="any")
        except can.CanError:
            if time.monotonic() > deadline_s:
                raise
