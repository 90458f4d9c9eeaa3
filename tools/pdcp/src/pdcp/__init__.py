"""Host side of the PDCP bus arbitrator: prosthetic parts on a CAN bus, configured over a serial line.

    with pdcp.Client("/dev/ttyUSB0") as arbitrator:
        for link in arbitrator.links():
            print(link.output, "feeds", link.input)

Client is for scripts, AsyncClient for programs on asyncio; both do the same.
"""

from .aclient import AsyncClient
from .client import Client
from .errors import (
    BadAnswerError,
    ConnectionFailedError,
    ErrorCode,
    NoAnswerError,
    PdcpError,
    RequestError,
    ResetError,
    UnknownMessageError,
)
from .events import Event, EventKind
from .model import (
    Action,
    ArbitratorInfo,
    Channel,
    ChannelId,
    Device,
    Direction,
    Flags,
    Identity,
    Link,
    LinkStatus,
    Stats,
    SystemInfo,
)

__version__ = "0.1.0"

__all__ = [
    "Action",
    "ArbitratorInfo",
    "AsyncClient",
    "BadAnswerError",
    "Channel",
    "ChannelId",
    "Client",
    "ConnectionFailedError",
    "Device",
    "Direction",
    "ErrorCode",
    "Event",
    "EventKind",
    "Flags",
    "Identity",
    "Link",
    "LinkStatus",
    "NoAnswerError",
    "PdcpError",
    "RequestError",
    "ResetError",
    "Stats",
    "SystemInfo",
    "UnknownMessageError",
]
