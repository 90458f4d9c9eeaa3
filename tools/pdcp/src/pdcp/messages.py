# generated from docs/spec/protocol.toml by tools/gen_protocol.py; do not edit
"""The messages of the host API [API 3.2, 3.3], and the extension group 24xxh (D-API-5).

Each message is a dataclass whose fields are its payload, in the order of the wire (payload.py). The success
answer of request n is n + 1, its failure answer n + 2."""

from dataclasses import dataclass

from .payload import (
    MESSAGES,
    U8,
    U16,
    U32,
    Chan,
    Dev,
    Failure,
    FormatError,
    Mask,
    Message,
    Octets,
    Request,
    Rest,
    U32s,
    Value,
    unpack,
)

__all__ = [
    "ArbitratorInfoFailure",
    "ArbitratorInfoSuccess",
    "ConfigureLink",
    "ConfigureLinkFailure",
    "ConfigureLinkSuccess",
    "DeviceInfoFailure",
    "DeviceInfoSuccess",
    "EventMessage",
    "Failure",
    "FormatError",
    "GetArbitratorInfo",
    "GetDeviceInfo",
    "GetInputInfo",
    "GetLinkInfo",
    "GetOutputInfo",
    "GetParameter",
    "GetParameterFailure",
    "GetParameterSuccess",
    "GetStatistics",
    "GetSystemInfo",
    "InputInfoFailure",
    "InputInfoSuccess",
    "LinkInfoFailure",
    "LinkInfoSuccess",
    "MESSAGES",
    "Message",
    "OutputInfoFailure",
    "OutputInfoSuccess",
    "Passthrough",
    "PassthroughFailure",
    "PassthroughSuccess",
    "ProfileAction",
    "ProfileActionFailure",
    "ProfileActionSuccess",
    "ReadConfigurations",
    "ReadConfigurationsFailure",
    "ReadConfigurationsSuccess",
    "RemoveLink",
    "RemoveLinkFailure",
    "RemoveLinkSuccess",
    "Request",
    "Reset",
    "ResetFailure",
    "ResetSuccess",
    "SetFlags",
    "SetFlagsFailure",
    "SetFlagsSuccess",
    "SetParameter",
    "SetParameterFailure",
    "SetParameterSuccess",
    "StatisticsFailure",
    "StatisticsSuccess",
    "StreamEvents",
    "StreamEventsFailure",
    "StreamEventsSuccess",
    "SystemInfoFailure",
    "SystemInfoSuccess",
    "UnknownId",
    "WriteConfigurations",
    "WriteConfigurationsFailure",
    "WriteConfigurationsSuccess",
    "unpack",
]

# --- 22xxh: the tables ---


@dataclass(frozen=True)
class UnknownId(Message, id=0x2200):
    """Answer to an id that does not exist [API 3.3.1]."""


@dataclass(frozen=True)
class GetSystemInfo(Request["SystemInfoSuccess"], id=0x2201, reads=True):
    """How many devices, channels and links there are [API 3.3.2]."""


@dataclass(frozen=True)
class SystemInfoSuccess(Message, id=0x2202):
    devices: U8
    inputs: U8
    outputs: U8
    links: U8


class SystemInfoFailure(Failure, id=0x2203):
    pass


@dataclass(frozen=True)
class GetDeviceInfo(Request["DeviceInfoSuccess"], id=0x2204, reads=True):
    """A device, by its number from 1 [API 3.3.5]."""

    number: U8


@dataclass(frozen=True)
class DeviceInfoSuccess(Message, id=0x2205):
    channel: Chan
    type: U16
    profile: U16


class DeviceInfoFailure(Failure, id=0x2206):
    pass


@dataclass(frozen=True)
class GetInputInfo(Request["InputInfoSuccess"], id=0x2207, reads=True):
    """An input channel, by its number from 1 [API 3.3.8]."""

    number: U8


@dataclass(frozen=True)
class InputInfoSuccess(Message, id=0x2208):
    channel: Chan
    type: U16
    profile: U16


class InputInfoFailure(Failure, id=0x2209):
    pass


@dataclass(frozen=True)
class GetOutputInfo(Request["OutputInfoSuccess"], id=0x220A, reads=True):
    """An output channel, by its number from 1 [API 3.3.11]."""

    number: U8


@dataclass(frozen=True)
class OutputInfoSuccess(Message, id=0x220B):
    channel: Chan
    type: U16
    profile: U16


class OutputInfoFailure(Failure, id=0x220C):
    pass


@dataclass(frozen=True)
class GetLinkInfo(Request["LinkInfoSuccess"], id=0x220D, reads=True):
    """A link, by its number from 1 [API 3.3.14]."""

    number: U8


@dataclass(frozen=True)
class LinkInfoSuccess(Message, id=0x220E):
    output: Chan
    input: Chan
    status: U8


class LinkInfoFailure(Failure, id=0x220F):
    pass


# --- 23xxh: the devices ---


@dataclass(frozen=True)
class GetParameter(Request["GetParameterSuccess"], id=0x2301, reads=True):
    """Read a parameter of a device (index 0) or a channel [API 3.3.17]."""

    channel: Chan
    parameter: U8


@dataclass(frozen=True)
class GetParameterSuccess(Message, id=0x2302):
    value: Rest


class GetParameterFailure(Failure, id=0x2303):
    pass


@dataclass(frozen=True)
class SetParameter(Request["SetParameterSuccess"], id=0x2304):
    """Write a parameter of a device (index 0) or a channel [API 3.3.20] (D-API-7)."""

    channel: Chan
    parameter: U8
    value: Value


@dataclass(frozen=True)
class SetParameterSuccess(Message, id=0x2305):
    pass


class SetParameterFailure(Failure, id=0x2306):
    pass


@dataclass(frozen=True)
class ConfigureLink(Request["ConfigureLinkSuccess"], id=0x2307):
    """Make a link [API 3.3.23] (D-API-6)."""

    output: Chan
    input: Chan


@dataclass(frozen=True)
class ConfigureLinkSuccess(Message, id=0x2308):
    status: U8


class ConfigureLinkFailure(Failure, id=0x2309):
    pass


@dataclass(frozen=True)
class Passthrough(Request["PassthroughSuccess"], id=0x230A):
    """Send a frame to a device; success is the answer of the device [API 3.3.26] (D-API-11)."""

    device: Dev
    dlc: U8
    data: Octets


@dataclass(frozen=True)
class PassthroughSuccess(Message, id=0x230B):
    device: Dev
    dlc: U8
    data: Octets


class PassthroughFailure(Failure, id=0x230C):
    pass


@dataclass(frozen=True)
class Reset(Request["ResetSuccess"], id=0x230D):
    """Reset a device by its number, or all with 0 [API 3.3.29] (D-API-12)."""

    number: U8


@dataclass(frozen=True)
class ResetSuccess(Message, id=0x230E):
    pass


@dataclass(frozen=True)
class ResetFailure(Message, id=0x230F):
    """Bit 0 of the first byte is device 1; cleared: not reset."""

    results: Octets


# --- 24xxh: the arbitrator ---


@dataclass(frozen=True)
class GetArbitratorInfo(Request["ArbitratorInfoSuccess"], id=0x2401, reads=True):
    """What the arbitrator is, and what it is doing (D-API-5)."""


@dataclass(frozen=True)
class ArbitratorInfoSuccess(Message, id=0x2402):
    protocol: U8
    firmware_major: U8
    firmware_minor: U8
    firmware_patch: U8
    devices_max: U8
    channels_max: U8
    links_max: U8
    profile_state: U8
    active: U8
    stored: U8
    flags: U8


class ArbitratorInfoFailure(Failure, id=0x2403):
    pass


@dataclass(frozen=True)
class SetFlags(Request["SetFlagsSuccess"], id=0x2404):
    """Set the flags (D-API-5, D-API-13)."""

    flags: U8


@dataclass(frozen=True)
class SetFlagsSuccess(Message, id=0x2405):
    pass


class SetFlagsFailure(Failure, id=0x2406):
    pass


@dataclass(frozen=True)
class ProfileAction(Request["ProfileActionSuccess"], id=0x2407):
    """Have the profile layer do something; the result is how many links were made or removed (D-API-5, D-API-13)."""

    action: U8
    argument: U8


@dataclass(frozen=True)
class ProfileActionSuccess(Message, id=0x2408):
    result: U16


class ProfileActionFailure(Failure, id=0x2409):
    pass


@dataclass(frozen=True)
class ReadConfigurations(Request["ReadConfigurationsSuccess"], id=0x240A, reads=True):
    """Read a piece of the stored configurations, up to 128 bytes (D-API-5, D-API-15)."""

    offset: U16
    length: U8


@dataclass(frozen=True)
class ReadConfigurationsSuccess(Message, id=0x240B):
    total: U16
    offset: U16
    data: Rest


class ReadConfigurationsFailure(Failure, id=0x240C):
    pass


@dataclass(frozen=True)
class WriteConfigurations(Request["WriteConfigurationsSuccess"], id=0x240D):
    """Write the stored configurations piece by piece (D-API-5, D-API-15)."""

    offset: U16
    total: U16
    data: Value


@dataclass(frozen=True)
class WriteConfigurationsSuccess(Message, id=0x240E):
    pass


class WriteConfigurationsFailure(Failure, id=0x240F):
    pass


@dataclass(frozen=True)
class RemoveLink(Request["RemoveLinkSuccess"], id=0x2410):
    """Remove the link of an input (D-API-5, D-API-13)."""

    input: Chan


@dataclass(frozen=True)
class RemoveLinkSuccess(Message, id=0x2411):
    pass


class RemoveLinkFailure(Failure, id=0x2412):
    pass


@dataclass(frozen=True)
class GetStatistics(Request["StatisticsSuccess"], id=0x2413, reads=True):
    """A group of counters (D-API-5)."""

    group: U8


@dataclass(frozen=True)
class StatisticsSuccess(Message, id=0x2414):
    group: U8
    counters: U32s


class StatisticsFailure(Failure, id=0x2415):
    pass


@dataclass(frozen=True)
class StreamEvents(Request["StreamEventsSuccess"], id=0x2416):
    """Ask for events of these kinds, 0 for none (D-API-5, D-API-20)."""

    mask: Mask


@dataclass(frozen=True)
class StreamEventsSuccess(Message, id=0x2417):
    pass


class StreamEventsFailure(Failure, id=0x2418):
    pass


@dataclass(frozen=True)
class EventMessage(Message, id=0x2419):
    """An event that was asked for with 2416h; its reference is 0 (D-API-5)."""

    kind: U8
    time_ms: U32
    data: Rest
