# generated from docs/spec/protocol.toml by tools/gen_protocol.py; do not edit
"""Numbers of the protocol and tables of its codes, parameters and counters."""

from enum import IntEnum, IntFlag

VERSION = 1  # of the host API
NODE_MAX = 254  # highest id; 255 is never given out (D-BUS-2)
NO_CHANNEL = 255  # channel index
VALUE_MAX = 512  # longest value that passes between host and device, bytes (D-BUS-13)
SYNC1 = 254  # first byte
SYNC2 = 25  # second byte
HEADER_SIZE = 8  # bytes of a header
CRC16_SIZE = 2  # bytes of the checksum behind a payload
PAYLOAD_MAX = 520  # longest payload of a request: a 2304h (D-API-7)


class Response(IntEnum):
    """Response codes [PDCP 3.2.2]."""

    FAILURE = 0
    SUCCESS = 1
    USE_BULK = 2  # use bulk transfer


class Transfer(IntEnum):
    """Transfer type, parameter 3 of a channel [PROFILE table 2.9]."""

    INPUT = 1
    OUTPUT = 2


class TypeSize(IntEnum):
    """Byte size of a channel's type, bits 0 and 1 [PROFILE listing 4.9]."""

    BITS_4 = 0  # 4 bits
    BITS_8 = 1  # 8 bits
    BITS_12 = 2  # 12 bits
    BITS_16 = 3  # 16 bits


class TypeData(IntEnum):
    """Data type of a channel's type, bits 2 and 3 [PROFILE listing 4.9]."""

    SIGNED = 0
    UNSIGNED = 1
    FLOAT = 2
    BOOLEAN = 3


class TypeControl(IntEnum):
    """Control mode of a channel's type, bits 4 and 5 [PROFILE listing 4.9]."""

    POSITION = 0
    VELOCITY = 1
    ACCELERATION = 2
    OTHER = 3


class TypePrescaler(IntEnum):
    """Prescaler of a channel's type, bits 8 to 10 (D-PRO-8)."""

    ONE = 0  # x1
    MICRO = 1  # x10^-6
    MILLI = 2  # x10^-3
    TENTH = 3  # x10^-1
    TEN = 4  # x10
    HUNDRED = 5  # x10^2
    THOUSAND = 6  # x10^3
    MILLION = 7  # x10^6


class ErrorCode(IntEnum):
    """Error codes of failure answers (D-API-4)."""

    WRONG_SIZE = 0x01  # wrong payload size
    OUT_OF_RANGE = 0x02  # number out of range
    UNKNOWN_DEVICE = 0x03
    UNKNOWN_CHANNEL = 0x04  # unknown channel or wrong direction
    DEVICE_SILENT = 0x05  # the device did not answer
    DEVICE_REFUSED = 0x06  # the device refused
    BUSY = 0x07  # the arbitrator is busy
    SOLE_ACCESS = 0x08  # another input has sole access to this output
    NO_NODE_ID = 0x09  # no free node id
    BULK_FAILED = 0x0A  # the bulk transfer failed
    NOT_READY = 0x0B  # not ready, setup still running
    CRC = 0x0C  # the request arrived with a wrong checksum
    STORAGE = 0x0D  # the storage failed or is full
    NOT_SUPPORTED = 0x0E
    BAD_VALUE = 0x0F


class LinkStatus(IntEnum):
    """Status of a link (D-BUS-10)."""

    GONE = 0
    INACTIVE = 1  # inactive: one end is missing
    ACTIVE = 2


class ProfileState(IntEnum):
    """What the profile layer is doing (2402h) (D-API-5)."""

    WAITING = 0  # waiting for the start-up
    CONFIGURING = 1
    RUNNING = 2


class Flags(IntFlag):
    """Settings of the arbitrator (2402h, 2404h) (D-API-5)."""

    AUTOCONFIGURE = 0x01
    HOT_SWAP = 0x02
    AUTO_SAVE = 0x04  # auto-save
    STRICT_CRC = 0x08  # strict CRC
    EVENT_STREAM = 0x10  # event stream on; read only


class Action(IntEnum):
    """Actions of the profile layer (2407h) (D-API-5)."""

    SAVE = 1  # save as configuration argument, 0: the active one
    LOAD = 2  # load configuration argument, 0: the active one
    ERASE = 3  # erase configuration argument, 0: the active one
    AUTOCONFIGURE = 4
    CLEAR = 5  # remove all links
    ENFORCE = 6  # enforce sole access
    REPLACE = 7  # find replacements
    ADOPT = 8  # adopt the stand-ins into the configuration


class BusState(IntEnum):
    """State of the arbitrator's CAN controller (D-API-5)."""

    ACTIVE = 0  # error-active
    PASSIVE = 1  # error-passive
    OFF = 2  # bus-off, or there is no bus
    SILENT = 3  # silent: on standby


class ConfigurationCode(IntEnum):
    """Codes of the string of stored configurations: code u8, value u16 [PROFILE table 4.1] (D-PRO-7)."""

    CONFIGURATIONS = 1  # number of configurations
    CONFIGURATION = 2  # configuration, its number
    LINKS = 3  # number of links
    LINK = 4  # channel link, its index
    INPUT = 5  # input channel, 0
    OUTPUT = 6  # output channel, 0
    CHANNEL_TYPE = 7
    CHANNEL_PROFILE = 8
    CHANNEL_INDEX = 9
    OWNER_VID = 10  # VID of its device
    OWNER_PID = 11  # PID of its device
    OWNER_SN = 12  # serial number of its device
    OWNER_TYPE = 13  # type of its device
    OWNER_PROFILE = 14  # profile of its device
    END = 15  # end, 0


class FunctionCode(IntEnum):
    """Function codes of requests; an answer has 80h more [PDCP 3.1]."""

    BIND_DEVICE = 0x01
    GET_DEVICE_INFO = 0x02
    GET_PARAMETER = 0x03
    SET_PARAMETER = 0x04
    IND_GET_PARAMETER = 0x05
    IND_SET_PARAMETER = 0x06
    SET_NODE_ID = 0x07
    SUSPEND = 0x08
    RELEASE = 0x09
    BEACON = 0x0A
    RESET = 0x0B
    BULK_GET = 0x0C
    BULK_SET = 0x0D
    BULK_DATA = 0x0E
    UPDATE_CHANNEL = 0x0F


class EventKind(IntEnum):
    """Kinds of events; bit kind - 1 of the mask asks for one (2416h, 2419h)."""

    DEVICE_BOUND = 1
    DEVICE_LOST = 2
    LINK_CHANGED = 3
    CONFIGURATION_CHANGED = 4
    CAN_FRAME = 5  # CAN frame, of both directions
    BUS_STATE = 6
    AUDIT = 9  # a channel does not have what the tables say

    @property
    def mask(self) -> int:
        return 1 << (self - 1)


# What the members of the enumerations mean, by the ids of their sets.
TEXTS: dict[str, dict[int, str]] = {
    "response": {0: "failure", 1: "success", 2: "use bulk transfer"},
    "transfer": {1: "input", 2: "output"},
    "type_size": {0: "4 bits", 1: "8 bits", 2: "12 bits", 3: "16 bits"},
    "type_data": {0: "signed", 1: "unsigned", 2: "float", 3: "boolean"},
    "type_control": {0: "position", 1: "velocity", 2: "acceleration", 3: "other"},
    "type_prescaler": {0: "x1", 1: "x10^-6", 2: "x10^-3", 3: "x10^-1", 4: "x10", 5: "x10^2", 6: "x10^3", 7: "x10^6"},
    "error": {
        1: "wrong payload size",
        2: "number out of range",
        3: "unknown device",
        4: "unknown channel or wrong direction",
        5: "the device did not answer",
        6: "the device refused",
        7: "the arbitrator is busy",
        8: "another input has sole access to this output",
        9: "no free node id",
        10: "the bulk transfer failed",
        11: "not ready, setup still running",
        12: "the request arrived with a wrong checksum",
        13: "the storage failed or is full",
        14: "not supported",
        15: "bad value",
    },
    "link_status": {0: "gone", 1: "inactive: one end is missing", 2: "active"},
    "profile_state": {0: "waiting for the start-up", 1: "configuring", 2: "running"},
    "flags": {1: "autoconfigure", 2: "hot swap", 4: "auto-save", 8: "strict CRC", 16: "event stream on; read only"},
    "action": {
        1: "save as configuration argument, 0: the active one",
        2: "load configuration argument, 0: the active one",
        3: "erase configuration argument, 0: the active one",
        4: "autoconfigure",
        5: "remove all links",
        6: "enforce sole access",
        7: "find replacements",
        8: "adopt the stand-ins into the configuration",
    },
    "bus_state": {0: "error-active", 1: "error-passive", 2: "bus-off, or there is no bus", 3: "silent: on standby"},
    "configuration_code": {
        1: "number of configurations",
        2: "configuration, its number",
        3: "number of links",
        4: "channel link, its index",
        5: "input channel, 0",
        6: "output channel, 0",
        7: "channel type",
        8: "channel profile",
        9: "channel index",
        10: "VID of its device",
        11: "PID of its device",
        12: "serial number of its device",
        13: "type of its device",
        14: "profile of its device",
        15: "end, 0",
    },
}

# Code, name, sizes, fields with their bytes (0: all that is left), who sends it, is it deprecated.
FunctionRow = tuple[int, str, tuple[int, ...], tuple[tuple[str, int], ...], tuple[str, ...], bool]
FUNCTIONS: tuple[FunctionRow, ...] = (
    (0x01, "Bind Device Request", (7,), (("vid", 2), ("pid", 2), ("sn", 2)), ("device",), False),
    (0x02, "GetDeviceInfo", (2,), (("rest", 0),), ("arbitrator",), True),
    (0x03, "Get Device Parameter", (3,), (("parameter", 1), ("channel", 1)), ("arbitrator",), False),
    (
        0x04,
        "Set Device Parameter",
        (4, 5, 6, 7),
        (("parameter", 1), ("channel", 1), ("value", 0)),
        ("arbitrator",),
        False,
    ),
    (0x05, "IndGetDeviceParameter", (4,), (("rest", 0),), ("device",), True),
    (0x06, "IndSetDeviceParameter", (5, 6, 7, 8), (("rest", 0),), ("device",), True),
    (0x07, "SetNodeId", (2,), (("rest", 0),), ("arbitrator",), True),
    (0x08, "Suspend Device", (3,), (("time", 2),), ("arbitrator",), False),
    (0x09, "Release Device", (1,), (), ("arbitrator",), False),
    (0x0A, "Device Beacon", (1,), (), ("device", "arbitrator"), False),
    (0x0B, "Reset Device", (1,), (), ("arbitrator",), False),
    (
        0x0C,
        "Configure Get Bulk Data Transfer",
        (3, 5),
        (("parameter", 1), ("channel", 1), ("size", 2)),
        ("arbitrator",),
        False,
    ),
    (
        0x0D,
        "Configure Set Bulk Data Transfer",
        (5,),
        (("parameter", 1), ("channel", 1), ("size", 2)),
        ("arbitrator",),
        False,
    ),
    (0x0E, "Bulk Data Transfer", (3, 4, 5, 6, 7, 8), (("packet", 1), ("data", 0)), ("device", "arbitrator"), False),
    (0x0F, "Update Data Channel", (2,), (("channel", 1),), ("device",), False),
    (0x81, "Bind Device Response", (8,), (("node", 1), ("vid", 2), ("pid", 2), ("sn", 2)), ("arbitrator",), False),
    (0x82, "GetDeviceInfo Response", (2, 3, 4, 5, 6), (("rest", 0),), ("device",), True),
    (
        0x83,
        "Get Device Parameter Response",
        (4, 5, 6, 7, 8),
        (("response", 1), ("parameter", 1), ("channel", 1), ("value", 0)),
        ("device",),
        False,
    ),
    (
        0x84,
        "Set Device Parameter Response",
        (5, 6, 7, 8, 4),
        (("response", 1), ("parameter", 1), ("channel", 1), ("value", 0)),
        ("device",),
        False,
    ),
    (0x85, "IndGetDeviceParameter Response", (4, 5, 6, 7), (("rest", 0),), ("arbitrator",), True),
    (0x86, "IndSetDeviceParameter Response", (1,), (), ("arbitrator",), True),
    (0x87, "SetNodeId Response", (1,), (), ("device",), True),
    (0x88, "Suspend Device Response", (4, 1), (("response", 1), ("time", 2)), ("device",), False),
    (0x89, "Release Device Response", (2, 1), (("response", 1),), ("device",), False),
    (0x8B, "Reset Device Response", (2, 1), (("response", 1),), ("device",), False),
    (
        0x8C,
        "Configure Get Bulk Data Transfer Response",
        (6,),
        (("response", 1), ("parameter", 1), ("channel", 1), ("size", 2)),
        ("device",),
        False,
    ),
    (
        0x8D,
        "Configure Set Bulk Data Transfer Response",
        (6,),
        (("response", 1), ("parameter", 1), ("channel", 1), ("size", 2)),
        ("device",),
        False,
    ),
    (0x8E, "Bulk Data Transfer Response", (2,), (("response", 1),), ("device", "arbitrator"), False),
    (0x8F, "Update Data Channel Response", (3,), (("response", 1), ("channel", 1)), ("arbitrator",), False),
)

# First and last code, name.
CODE_RANGES: tuple[tuple[int, int, str], ...] = (
    (0x10, 0x4F, "Reserved System Code"),
    (0x50, 0x7F, "Device-Specific Code"),
    (0x90, 0xCF, "Reserved System Response"),
    (0xD0, 0xFE, "Device-Specific Response"),
)

# Kind, number, name, fields with their bytes and how they are shown, form.
ParameterRow = tuple[str, int, str, tuple[tuple[str, int, str], ...], str]
PARAMETERS: tuple[ParameterRow, ...] = (
    ("device", 1, "vid-pid", (("vid", 2, "number"), ("pid", 2, "number")), "fields"),
    ("device", 2, "serial-number", (("sn", 2, "number"),), "fields"),
    ("device", 3, "ean13-low", (("ean13_low", 4, "number"),), "fields"),
    ("device", 4, "ean13-high", (("ean13_high", 4, "number"),), "fields"),
    ("device", 5, "version", (("firmware", 2, "number"), ("hardware", 2, "number")), "fields"),
    ("device", 6, "type", (("type", 2, "word"), ("profile", 2, "word")), "fields"),
    ("device", 7, "descriptor", (), "text"),
    ("device", 8, "node-id", (("node_id", 1, "node"),), "fields"),
    ("device", 9, "channels", (("channels", 1, "number"),), "fields"),
    ("device", 10, "beacon-interval", (("beacon_interval", 2, "milliseconds"),), "fields"),
    ("device", 11, "ack-time", (("ack_time", 2, "milliseconds"),), "fields"),
    ("device", 12, "bind-timeout", (("bind_timeout", 2, "milliseconds"),), "fields"),
    ("input", 1, "type", (("type", 2, "type"), ("profile", 2, "profile")), "fields"),
    ("input", 2, "descriptor", (), "text"),
    ("input", 3, "transfer-type", (("transfer_type", 1, "transfer"),), "fields"),
    ("input", 4, "enabled", (("enabled", 1, "switch"),), "fields"),
    ("input", 5, "source-device", (("vid", 2, "number"), ("pid", 2, "number")), "fields"),
    ("input", 6, "source-channel", (("sn", 2, "number"), ("index", 1, "number")), "fields"),
    ("input", 7, "source-nodes", (("device_node", 1, "node"), ("output_node", 1, "node")), "fields"),
    ("input", 8, "source-type", (("type", 2, "type"), ("profile", 2, "profile")), "fields"),
    ("input", 9, "required", (), "channels"),
    ("input", 10, "desired", (), "channels"),
    ("input", 11, "terminal-profile", (("terminal_profile", 2, "profile"),), "fields"),
    ("output", 1, "type", (("type", 2, "type"), ("profile", 2, "profile")), "fields"),
    ("output", 2, "descriptor", (), "text"),
    ("output", 3, "transfer-type", (("transfer_type", 1, "transfer"),), "fields"),
    ("output", 4, "enabled", (("enabled", 1, "switch"),), "fields"),
    ("output", 5, "node-id", (("node_id", 1, "node"),), "fields"),
    ("output", 9, "required", (), "channels"),
    ("output", 10, "desired", (), "channels"),
)

# Of an input that is not connected, by parameter.
NO_SOURCE: dict[int, tuple[int, ...]] = {5: (65535, 65535), 6: (65535, 255), 7: (0, 0), 8: (0, 0)}

# Groups in their order: name, then name and meaning of each counter.
COUNTERS: tuple[tuple[str, tuple[tuple[str, str], ...]], ...] = (
    (
        "bus",
        (
            ("rx", "frames received"),
            ("tx", "frames sent"),
            ("tx_full", "frames lost because the transmit queue was full"),
            ("drop_extended", "dropped: 29-bit identifier"),
            ("drop_remote", "dropped: remote frame"),
            ("drop_error", "dropped: error report of the controller"),
            ("drop_fd", "dropped: CAN FD frame"),
            ("drop_unused_id", "dropped: identifier that the protocol does not use"),
            ("drop_arbitrator", "dropped: sent in the name of an arbitrator, but not by this one"),
            ("foreign_beacon", "beacons of another arbitrator"),
            ("drop_unknown_id", "dropped: from an id that is not bound"),
            ("drop_bad_dlc", "dropped: wrong number of data bytes"),
            ("drop_bad_code", "dropped: unknown function code, or no data"),
            ("drop_direction", "dropped: function code that a device must not send"),
            ("drop_deprecated", "dropped: deprecated function code"),
            ("drop_late", "dropped: answer that nobody waits for"),
            ("drop_binding", "dropped: binding frame that is no bind request"),
            ("channel_data", "frames of output channels"),
            ("bind_granted", "bind requests granted"),
            ("bind_suggested", "bind requests answered with another id"),
            ("bind_refused", "bind requests refused: no id or no place left"),
            ("bind_duplicate", "bind requests with the identity of a bound device"),
            ("requests", "requests to devices"),
            ("repeats", "requests repeated"),
            ("no_answer", "requests that were never answered"),
            ("bulk_restarts", "bulk transfers begun again"),
            ("setup_failed", "devices that could not be set up"),
            ("no_room", "channels that found their table full"),
            ("lost", "devices lost"),
            ("link_failed", "links that could not be made"),
            ("unknown_reset", "unbound devices told to reset"),
            ("taken", "frames that the arbitrator made use of"),
            ("drop_silent", "dropped: on standby"),
            ("tx_discarded", "frames discarded when the bus went off"),
            ("bus_off", "times off the bus"),
            ("audit", "parameters of channels that were not as they should be"),
        ),
    ),
    (
        "host",
        (
            ("bytes_received", "bytes from the host"),
            ("bytes_sent", "bytes to the host"),
            ("requests", "requests received"),
            ("bytes_skipped", "bytes between messages"),
            ("bad_size", "headers with an impossible size"),
            ("bad_crc8", "messages with a wrong CRC8"),
            ("bad_crc16", "messages with a wrong CRC16"),
            ("given_up", "messages that stopped in the middle"),
            ("busy", "requests refused because four were held"),
            ("unknown", "requests with an unknown id"),
            ("events_sent", "events sent"),
            ("dropped_bound", "events dropped: device bound"),
            ("dropped_lost", "events dropped: device lost"),
            ("dropped_link", "events dropped: link changed"),
            ("dropped_configuration", "events dropped: configuration changed"),
            ("dropped_frame", "events dropped: CAN frame"),
            ("dropped_bus_state", "events dropped: bus state"),
            ("dropped_7", "events dropped: kind 7, which there is not yet"),
            ("dropped_8", "events dropped: kind 8, which there is not yet"),
            ("dropped_audit", "events dropped: audit"),
        ),
    ),
    (
        "storage",
        (
            ("identities_failed", "writes of the identities that failed"),
            ("identities_damaged", "copies of the identities found damaged at the start"),
            ("flags_failed", "writes of the flags that failed"),
            ("flags_damaged", "copies of the flags found damaged at the start"),
            ("configuration_pages", "pages of configurations written"),
            ("configuration_writes", "times that configurations were stored"),
            ("configuration_unchanged", "times that they were what is stored already"),
            ("configuration_failures", "times that storing them failed"),
            ("configuration_damaged", "areas of configurations found damaged at the start"),
        ),
    ),
    (
        "drivers",
        (
            ("frames_lost", "received frames lost before the arbitrator took them"),
            ("frames_unsent", "frames that are known not to have left"),
            ("bytes_lost", "bytes from the host lost before the arbitrator took them"),
        ),
    ),
)
