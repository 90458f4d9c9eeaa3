"""Stored configurations as bytes and as YAML [PROFILE 4.5], profile-layer.md 5."""

import ctypes
import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdcp.tlv import Channel, Configuration, Link, TlvError, from_yaml, parse, to_yaml

ROOT = Path(__file__).resolve().parents[2]


def entries(*pairs: tuple[int, int]) -> bytes:
    return b"".join(bytes((code, value & 0xFF, value >> 8)) for code, value in pairs)


CHANNEL = ((7, 10), (8, 20), (9, 1), (10, 30), (11, 40), (12, 50), (13, 60), (14, 70))
FIGURE = entries(  # [PROFILE figure 4.10], values LSB first (D-PRO-7)
    (1, 2), (2, 1), (3, 2), (4, 1), (5, 0), *CHANNEL, (6, 0), *CHANNEL, (4, 2), (5, 0), (6, 0),
    (2, 2), (3, 1), (4, 1), (15, 0),
)  # fmt: skip

FIGURE_YAML = """\
configurations:
- configuration: 1
  links:
  - link: 1
    input:
      type: 0x000A  # 4 bits, signed, position, unused bits 0Ah
      profile: 0x0014
      index: 1
      vid: 30
      pid: 40
      serial: 50
      device_type: 0x003C
      device_profile: 0x0046
    output:
      type: 0x000A  # 4 bits, signed, position, unused bits 0Ah
      profile: 0x0014
      index: 1
      vid: 30
      pid: 40
      serial: 50
      device_type: 0x003C
      device_profile: 0x0046
  - link: 2
    input: {}
    output: {}
- configuration: 2
  links:
  - link: 1
"""


def test_figure_4_10_is_read() -> None:
    channel = Channel(10, 20, 1, 30, 40, 50, 60, 70)
    assert parse(FIGURE) == [
        Configuration(1, [Link(1, channel, channel), Link(2)]),
        Configuration(2, [Link(1)]),
    ]


def test_figure_4_10_as_yaml_and_back() -> None:
    assert to_yaml(FIGURE) == FIGURE_YAML
    assert from_yaml(FIGURE_YAML) == FIGURE


def test_profiles_have_their_name_beside() -> None:
    data = entries((1, 1), (2, 1), (3, 1), (4, 1), (5, 0), (7, 0x5300), (8, 0x1220), (15, 0))
    text = to_yaml(data)
    assert "      type: 0x5300  # 8 bits, unsigned, position, sole access, terminal\n" in text
    assert "      profile: 0x1220  # Power grip\n" in text
    assert from_yaml(text) == data


def test_tolerant_reader() -> None:
    """Unknown codes are skipped, missing values are 0, the output may come first."""
    data = entries(
        (99, 7), (1, 1), (2, 3), (98, 1), (3, 1), (4, 5), (97, 2), (6, 0), (8, 0x2220), (96, 3), (5, 0), (9, 2), (15, 0)
    )
    assert parse(data) == [Configuration(3, [Link(5, Channel(index=2), Channel(profile=0x2220))])]
    assert parse(data + b"anything") == parse(data)


def test_unknown_codes_order_and_missing_values_stay_tidy() -> None:
    data = entries(
        (1, 1), (2, 3), (3, 1), (98, 1), (4, 5), (97, 2), (6, 0), (8, 0x2220), (96, 3), (5, 0), (9, 2), (15, 0)
    )
    text = to_yaml(data)
    assert text == (
        "configurations:\n- configuration: 3\n  code_98: 0x0001\n  links:\n  - link: 5\n    code_97: 0x0002\n"
        "    output:\n      profile: 0x2220  # EMG amplitude\n      code_96: 0x0003\n    input:\n      index: 2\n"
    )
    assert from_yaml(text) == data


ODD = {  # legal, but not told by a tree
    "a value twice": entries((1, 1), (2, 1), (3, 1), (4, 1), (5, 0), (8, 1), (8, 2), (15, 0)),
    "values out of order": entries((1, 1), (2, 1), (3, 1), (4, 1), (5, 0), (9, 1), (7, 2), (15, 0)),
    "a count behind links": entries((1, 1), (2, 1), (4, 1), (3, 1), (15, 0)),
    "an input with a value of its own": entries((1, 1), (2, 1), (3, 1), (4, 1), (5, 9), (15, 0)),
    "an end with a value": entries((1, 0), (15, 0x1234)),
    "something behind the end": entries((1, 0), (15, 0)) + b"\x01\x02",
    "no count of none": entries((15, 0)),
    "an unknown code at the start": entries((77, 1), (1, 0), (15, 0)),
    "an unknown code twice": entries((1, 1), (2, 1), (77, 1), (77, 2), (3, 0), (15, 0)),
}


@pytest.mark.parametrize("name", ODD)
def test_odd_but_legal_strings_survive(name: str) -> None:
    parse(ODD[name])
    assert from_yaml(to_yaml(ODD[name])) == ODD[name]


def test_no_configurations() -> None:
    assert to_yaml(entries((1, 0), (15, 0))) == "configurations: []\n"
    assert from_yaml("configurations: []") == entries((1, 0), (15, 0))
    assert parse(entries((1, 0), (15, 0))) == []


# D-PRO-20
ONE_LINK = ((2, 1), (3, 1), (4, 1))
BAD = {
    "no end (code 15) in 0 bytes": b"",
    "no end (code 15) in 3 bytes": entries((1, 0)),
    "no end (code 15) in 5 bytes": entries((1, 0)) + b"\x0f\x00",
    "2 configurations are announced, 1 are there": entries((1, 2), *ONE_LINK, (15, 0)),
    "0 configurations are announced, 1 are there": entries(*ONE_LINK, (15, 0)),
    "configuration 1 announces 2 links and has 1": entries((1, 1), (2, 1), (3, 2), (4, 1), (15, 0)),
    "byte 12: configuration 1 announces 0 links and has 1": entries((1, 2), (2, 1), (99, 0), (4, 1), (2, 2), (15, 0)),
    "byte 12: configuration 1 is there twice": entries((1, 2), *ONE_LINK, (2, 1), (15, 0)),
    "byte 12: link 1 is there twice in configuration 1": entries((1, 1), (2, 1), (3, 2), (4, 1), (4, 1), (15, 0)),
    "byte 15: link 1 has two inputs": entries((1, 1), *ONE_LINK, (5, 0), (5, 0), (15, 0)),
    "byte 3: the number of configurations is there twice": entries((1, 1), (1, 1), *ONE_LINK, (15, 0)),
    "byte 3: the number of configurations comes behind one of them": entries((2, 1), (1, 1), (15, 0)),
    "byte 9: configuration 1 has two numbers of links": entries((1, 1), (2, 1), (3, 0), (3, 0), (15, 0)),
    "byte 0: a number of links belongs to no configuration": entries((3, 1), (15, 0)),
    "byte 0: link 1 belongs to no configuration": entries((4, 1), (15, 0)),
    "byte 6: an output belongs to no link": entries((1, 1), (2, 1), (6, 0), (15, 0)),
    "byte 12: channel_type belongs to no channel": entries((1, 1), *ONE_LINK, (7, 0), (15, 0)),
    "byte 3: configuration 0 is not within 1 to 255": entries((1, 1), (2, 0), (15, 0)),
    "byte 3: configuration 256 is not within 1 to 255": entries((1, 1), (2, 256), (15, 0)),
    "byte 9: link 256 is above 255": entries((1, 1), (2, 1), (3, 1), (4, 256), (15, 0)),
    "byte 15: channel index 256 is above 255": entries((1, 1), *ONE_LINK, (5, 0), (9, 256), (15, 0)),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_strings_are_rejected_with_the_place(message: str) -> None:
    with pytest.raises(TlvError) as caught:
        parse(BAD[message])
    assert str(caught.value) == message
    assert from_yaml(to_yaml(BAD[message])) == BAD[message]


BAD_YAML = {
    "": "line 1: the text is empty",
    "configurations: [": "line 1: expected the node content, but found '<stream end>'",
    "links: []": "line 1: there must be configurations, or else entries and perhaps rest",
    "configurations: 3": "line 1: configurations must be a list",
    "configurations:\n- links: []": "line 2: a configuration must begin with configuration, its index",
    "configurations:\n- configuration: 1": "line 2: a configuration must end with links",
    "configurations:\n- configuration: 1\n  links:\n  - link: 1\n    input:\n      size: 3": (
        "line 6: size is not known here; known are type, profile, index, vid, pid, serial, device_type, "
        "device_profile and code_N with N an unknown code of 0 to 255"
    ),
    "configurations:\n- configuration: 1\n  links:\n  - link: 1\n    input: {vid: 0x10000}": (
        "line 5: vid is 0x10000, which is not within 0 to 65535"
    ),
    "configurations:\n- configuration: one\n  links: []": (
        "line 2: configuration must be a number, 0 to 65535 or 0x0 to 0xFFFF"
    ),
    "configurations:\n- configuration: 1\n  links:\n  - link: 1\n    input: {vid: 1, vid: 2}": (
        "line 5: vid is there twice"
    ),
    "entries:\n- {link: 1, end: 0}": "line 2: an entry must be one name and its value",
    "entries: []\nrest: xyz": "line 2: rest must be bytes in hexadecimal",
    "entries:\n- code_8: 1": (
        "line 2: code_8 is not known here; known are number_of_configurations, configuration, number_of_links, link, "
        "input, output, end, channel_type, channel_profile, channel_index, owner_vid, owner_pid, owner_serial, "
        "owner_type, owner_profile and code_N with N an unknown code of 0 to 255"
    ),
    "a: \x01": "no YAML: unacceptable character #x0001: special characters are not allowed",
}


@pytest.mark.parametrize("text", BAD_YAML)
def test_bad_yaml_is_rejected_with_the_line(text: str) -> None:
    with pytest.raises(TlvError) as caught:
        from_yaml(text)
    assert str(caught.value) == BAD_YAML[text]


def test_deep_and_recursive_yaml_is_rejected() -> None:
    for text in ("[" * 100000, "&a [*a]", "configurations: &a [*a]"):
        with pytest.raises(TlvError):
            from_yaml(text)


WORDS = st.integers(0, 0xFFFF)
CODES = st.one_of(st.integers(0, 20), st.integers(0, 255))
STRINGS = st.lists(st.tuples(CODES, st.one_of(st.integers(0, 3), WORDS))).map(lambda pairs: entries(*pairs))


@st.composite
def sound_strings(draw: st.DrawFn) -> bytes:
    """Strings that a reader accepts, with things in them that it does not know."""
    numbers = draw(st.lists(st.integers(1, 255), unique=True, max_size=3))
    pairs = [(1, len(numbers))]
    other = st.lists(st.tuples(st.integers(16, 255), WORDS), max_size=2)
    for number in numbers:
        links = draw(st.lists(st.integers(0, 255), unique=True, max_size=3))
        pairs += [(2, number), (3, len(links)), *draw(other)]
        for link in links:
            pairs += [(4, link), *draw(other)]
            for end in draw(st.lists(st.sampled_from((5, 6)), unique=True)):
                codes = draw(st.lists(st.integers(7, 14), max_size=9))
                pairs += [(end, 0), *((code, draw(st.integers(0, 255))) for code in codes), *draw(other)]
    return entries(*pairs, (15, 0))


@given(st.one_of(st.binary(), STRINGS))
def test_any_bytes_survive(data: bytes) -> None:
    assert from_yaml(to_yaml(data)) == data
    assert from_yaml(to_yaml(data, entries=True)) == data


@given(sound_strings())
def test_sound_strings_survive(data: bytes) -> None:
    parse(data)
    assert from_yaml(to_yaml(data)) == data


@given(st.text())
def test_any_text_is_read_or_rejected(text: str) -> None:
    try:
        from_yaml(text)
    except TlvError as error:
        assert "\n" not in str(error)


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The reader of the arbitrator."""
    folder = tmp_path_factory.mktemp("tlv")
    source = folder / "accepts.c"
    source.write_text("""\
#include "profile_tlv.h"
int accepts(const uint8_t *bytes, uint16_t len);
int accepts(const uint8_t *bytes, uint16_t len)
{
    profile_tlv_t reader;
    profile_tlv_init(&reader, 0, 0);
    return profile_tlv_read(&reader, bytes, len) == PROFILE_TLV_DONE;
}
""")
    rooms = [ROOT / room for room in ("profile", "pdcp/common", "pdcp/arbitrator")]
    parts = [source, *(part for room in rooms for part in room.glob("*.c"))]
    library = folder / "accepts.so"
    includes = [f"-I{room}" for room in rooms]
    subprocess.run(["cc", "-std=c99", "-shared", "-fPIC", *includes, *parts, "-o", library], check=True)
    return ctypes.CDLL(str(library))


def test_firmware_rejects_the_same_strings(firmware: ctypes.CDLL) -> None:
    assert [name for name, data in ODD.items() if not firmware.accepts(data, len(data))] == []
    assert [name for name, data in BAD.items() if firmware.accepts(data, len(data))] == []


@given(data=st.one_of(STRINGS, sound_strings()))
def test_firmware_accepts_the_same_strings(firmware: ctypes.CDLL, data: bytes) -> None:
    try:
        parse(data)
        ours = True
    except TlvError:
        ours = False
    assert bool(firmware.accepts(data, len(data))) == ours
