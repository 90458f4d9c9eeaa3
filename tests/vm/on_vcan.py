"""pdcpd and pdcp-node as processes on vcan0, with can-utils as witness and as devices.

    python -m tests.vm.on_vcan PROGRAMS RESULTS [TEST]...

Expected frames are written from the specification (pdcp-bus.md 1 to 3), byte by byte. Identifiers for node id NN:
6NN bind request, 3NN from the arbitrator with normal priority, 2NN from a device with normal priority, 0NN high.
"""

import json
import re
import struct
import time
from contextlib import suppress
from typing import NamedTuple

from programs import Program, until

from pdcp import Channel, ChannelId, Device, Direction, Identity
from tests.vm.bench import (
    D1,
    D2,
    D3,
    DEADLINE_S,
    DEVICES,
    INTERFACE,
    LINKS,
    PARAMETER_NODE_ID,
    Bench,
    Candump,
    Limb,
    Player,
    cansend,
    cpu_ticks,
    is_asleep,
    main,
    run,
    wake_ups,
)

BEACON = "100#0A"
# VID 1234h, PID 5678h and a serial number, least significant byte first (D-BUS-1).
SERIAL = {name: f"34127856{number:02X}00" for name, number in (("A", 0x5C), ("B", 0x5D), ("C", 0x5E), ("D", 0x5F))}
BY_HAND = Identity(0x1234, 0x5678, 0x5C)

ALONE_S = 3.0  # without an arbitrator, until a device stops streaming (D-BUS-16)
QUIET_S = 3.0  # how long a process is watched
QUIET_TICKS = 3
IDS_KEPT_S = 12.5  # 1.5 s until a device is lost, 10 s more that its ids are kept, and a second


# --- the limb ---


def stats(node: Program) -> dict[str, int]:
    """Ends a pdcp-node and returns its counters."""
    assert node.stop() == 0, node.errors
    counters: dict[str, int] = json.loads(node.errors[-1])
    return counters


def data_of(candump: Candump, node_id: int) -> list[int]:
    """The one byte of each frame with channel data from an output."""
    start = f"0{node_id:02X}#"
    return [int(frame.text[4:], 16) for frame in candump.frames() if frame.text.startswith(start)]


class Outputs(NamedTuple):
    """Node ids of the outputs that have links."""

    sensor: int
    wrist: int
    grip: int


def outputs_of(limb: Limb) -> Outputs:
    return Outputs(limb.output_id(D1, 1), limb.output_id(D2, 3), limb.output_id(D2, 5))


def settle(limb: Limb, candump: Candump, sensor: int, sent: int) -> None:
    """D1, which sends no more, has sent so many values: they have gone all the way, and candump has shown everything.

    D2, then D3, answer a question. Both take their frames in order: what they were to do before, they have done."""
    until(lambda: len(data_of(candump, sensor)) >= sent, f"candump shows {sent} values of D1", DEADLINE_S)
    start = len(candump.texts())
    for device in (D2, D3):
        (node_id,) = limb.host.get_parameter(ChannelId(device), PARAMETER_NODE_ID)
        candump.await_frame(f"2{node_id:02X}#83010800{node_id:02X}", start)


def assert_whole(limb: Limb, candump: Candump, outputs: Outputs, sent_count: int) -> str:
    """The bus carried what D1 sent, D2 made of it and D3 received, no value more or less. D1 sends no more."""
    received: dict[int, list[int | None]] = {1: [], 2: []}

    def is_complete() -> bool:
        for channel, values in limb.received().items():
            received[channel] += values
        return all(len(received[i]) >= len(data_of(candump, outputs[i])) for i in (1, 2))

    settle(limb, candump, outputs.sensor, sent_count)
    with suppress(TimeoutError):  # what is missing is told below
        until(is_complete, "D3 prints as many values as candump shows of D2", DEADLINE_S)
    sent = data_of(candump, outputs.sensor)
    assert len(sent) == sent_count, f"D1 counts {sent_count} values, on the bus were\n{sent}"
    # The 8-bit range is passed on as it is; for a boolean, its upper half is true.
    for i, convert in ((1, int), (2, lambda value: int(value >= 128))):
        passed = data_of(candump, outputs[i])
        expected = [convert(value) for value in sent[-len(passed) :]]
        assert passed and passed == expected, f"D1 sent\n{sent}, D2 passed on\n{passed}"
        assert received[i] == passed, f"D2 sent\n{passed}, D3 received\n{received[i]}"
    return f"D1 sent {len(sent)} values; {len(received[1])} arrived at D3 channel 1, {len(received[2])} at channel 2"


def identity_hex(device: Identity) -> str:
    """VID, PID and SN as they stand in a frame."""
    return struct.pack("<HHH", device.vid, device.pid, device.sn).hex().upper()


def limb_of_four_processes_agrees_with_candump(bench: Bench) -> None:
    """Three devices bind, are linked over the host port, and D1's values arrive at both inputs of D3."""
    candump = bench.candump()
    limb = Limb(bench)
    limb.link()
    outputs = outputs_of(limb)
    until(lambda: len(data_of(candump, outputs.wrist)) >= 100, "100 values from D2", DEADLINE_S)
    for (name, device), node_id in zip(DEVICES.items(), limb.node_ids(), strict=True):
        identity = identity_hex(device)
        asked = f"6{node_id:02X}#01{identity}"
        assert asked in candump.texts(), f"no bind request {asked} of {name}"
        candump.await_frame(f"3{node_id:02X}#81{node_id:02X}{identity}", candump.texts().index(asked))
        bench.say(f"{name}: {asked}")
    assert limb.is_linked(), limb.links()
    counters = stats(limb.nodes["d1"])
    bench.say(assert_whole(limb, candump, outputs, counters["data_out"]))


def arbitrator_beacons_each_500_ms(bench: Bench) -> None:
    """100#0A, between 5 and 7 of them in 3 s, by candump's clock, as soon as the machine lets it."""
    candump = bench.candump()
    bench.pdcpd()

    def counts() -> list[int]:
        """Of beacons in 3 s, from the middle between two of them on."""
        times = [frame.time_s for frame in candump.frames() if frame.text == BEACON]
        starts = [at + 0.25 for at in times if at + 3.25 < times[-1]]
        return [sum(start <= at < start + 3 for at in times) for start in starts]

    until(lambda: any(5 <= count <= 7 for count in counts()), "5 to 7 beacons in 3 s", DEADLINE_S)
    bench.say(f"beacons in 3 s: {counts()}")
    assert set(candump.texts()) == {BEACON}, "nothing else is sent on a bus without devices"


# --- a device played by hand ---


def bind_by_hand(candump: Candump, asked: int, name: str) -> int:
    """Sends a bind request and returns the id in the answer, whose other bytes must be right."""
    start = len(candump.lines)
    cansend(f"6{asked:02X}#01{SERIAL[name]}")
    answer = candump.await_frame(rf"[0-9A-F]+#81.*{SERIAL[name]}.*", start)
    exact = re.fullmatch(rf"3{asked:02X}#81([0-9A-F]{{2}}){SERIAL[name]}", answer[0])
    assert exact is not None, f"{answer[0]} does not answer a request for {asked:02X}h"
    return int(exact[1], 16)


def bind_request_by_hand_is_granted(bench: Bench) -> None:
    """cansend 611#01..., candump shows 311#8111...; an id that is taken, 0 and 255 get another, which is granted."""
    candump = bench.candump()
    pdcpd = bench.pdcpd()
    assert bind_by_hand(candump, 0x11, "A") == 0x11
    candump.await_frame("311#811134127856" + "5C00")
    # A real device: an identity that says nothing more may be forgotten at any time.
    bench.node(bench.description("d1", node_id=0x20))
    until(lambda: any(f"{D1} (id 32) is set up" in line for line in pdcpd.errors), "D1 has id 20h", DEADLINE_S)
    for asked, name in ((0x20, "B"), (0x00, "C"), (0xFF, "D")):
        suggested = bind_by_hand(candump, asked, name)
        assert suggested not in (0x00, 0x20, 0xFF), f"{suggested:02X}h was suggested to {name}"
        assert bind_by_hand(candump, suggested, name) == suggested, "a suggested id is granted"
        bench.say(f"asked for {asked:02X}h, was suggested and granted {suggested:02X}h")


def bad_and_foreign_frames_are_not_answered(bench: Bench) -> None:
    """Wrong DLC, P=3 M=1, frames from another arbitrator, extended, remote and FD frames: silence."""
    frames = [
        "620#0134127856" + "60",  # 6 bytes
        "621#0134127856" + "610000",  # 8 bytes
        "622#",
        "623#8134127856" + "6200",  # an answer with P=3
        "624#0A",
        "00000625#0134127856" + "6300",  # extended
        "626#R",
        "627#R7",
        "628##00134127856" + "6400",  # CAN FD
        "729#0134127856" + "6500",  # P=3 M=1
        "32A#0134127856" + "6600",  # M=1: as if from an arbitrator
        "300#0B",  # broadcast Reset Device, as if from an arbitrator
        "12B#0A",
        "22C#83010100" + "34127856",  # an answer from an id that is not bound
        "22D#F0",
        "02E#0102030405060708",  # channel data of an unknown output
    ]
    candump = bench.candump()
    bench.pdcpd()
    candump.await_frame(BEACON)
    for frame in frames:
        cansend(frame)
    # Frames are served in the order of their arrival: when this is answered, the others were not.
    cansend("630#0134127856" + "6700")
    candump.await_frame("330#8130" + "34127856" + "6700")
    # An id that is not bound may be told to reset (D-BUS-15).
    answers = re.compile(rf"330#.*|3(2C|2D|2E)#0B|{BEACON}")
    shown = [text for text in candump.texts() if not answers.fullmatch(text)]
    assert len(shown) == len(frames) + 1, f"only what was sent by hand is on the bus: {shown}"


# What a device with one output answers, by what it is asked: Get is 03 parameter channel, Set is 04 parameter channel
# value. The output's node id is the arbitrator's choice.
ANSWERS = {
    "030100": "8301010034127856",  # VID, PID
    "030200": "830102005C00",  # serial number
    "030600": "8301060000000000",  # type, profile
    "030B00": "83010B00F401",  # time to wait for acknowledgement: 500 ms
    "030A00": "83010A001027",  # beacon interval: 10000 ms
    "030900": "8301090001",  # one channel
    "04040100": "8401040100",  # transfer off
    "030301": "8301030102",  # an output
    "030101": "8301010100502021",  # type 5000h, profile 2120h
    "030901": "83000901",  # required and desired channels: not supported
    "030A01": "83000A01",
}
# What it may be asked at any time after its setup (D-BUS-40).
AUDIT = {"030401": "8301040100"}
OUTPUT_ID_WRITTEN = r"040501([0-9A-F]{2})"


def play_device(candump: Candump, player: Player, start: int, done: str, end: str | None = None) -> list[str]:
    """Answers as the device with id 11h whatever is asked from frame number start on, until done is among it or the
    frame end is on the bus. Returns what was asked but the audit's questions."""
    requests: list[str] = []
    deadline = time.monotonic() + DEADLINE_S
    while True:
        texts = candump.texts()
        for text in texts[start:]:
            if text == end:
                return requests
            if not text.startswith("311#") or text.startswith("311#81"):
                continue
            request = text.removeprefix("311#")
            if request in AUDIT:
                player.send(f"211#{AUDIT[request]}")
                continue
            requests.append(request)
            output_id = re.fullmatch(OUTPUT_ID_WRITTEN, request)
            answer = f"84010501{output_id[1]}" if output_id is not None else ANSWERS.get(request)
            assert answer is not None, f"nobody may ask a device with one output for {request}"
            player.send(f"211#{answer}")
            if re.fullmatch(done, request):
                return requests
        start = len(texts)
        assert time.monotonic() < deadline, f"{done} was not asked for; {requests} was"
        time.sleep(0.002)


def device_by_hand_is_set_up(bench: Bench) -> None:
    """The setup's requests have the right bytes; answered by hand, the device and its output are there for the host."""
    candump = bench.candump()
    player = bench.player()
    pdcpd = bench.pdcpd()
    host = bench.host()
    assert bind_by_hand(candump, 0x11, "A") == 0x11
    requests = play_device(candump, player, 0, OUTPUT_ID_WRITTEN)
    bench.say("asked for, in this order: " + " ".join(requests))
    once = list(dict.fromkeys(requests))
    assert {*once[:-1]} == {*ANSWERS}, f"not asked for: {set(ANSWERS) - set(once)}"
    assert once.index("030100") < once.index("030900") < once.index("04040100") < once.index("030301")
    assert re.fullmatch(OUTPUT_ID_WRITTEN, once[-1]), once
    until(lambda: any("is set up" in line for line in pdcpd.errors), "pdcpd calls it set up", DEADLINE_S)
    assert host.system_info().devices == 0, "a device counts from its first beacon (D-API-6)"
    cansend("011#0A")
    until(lambda: host.system_info() == (1, 0, 1, 0), "the host sees one device and one output", DEADLINE_S)
    assert host.devices() == [Device(1, BY_HAND, 0, 0)]
    assert host.outputs() == [Channel(1, Direction.OUTPUT, ChannelId(BY_HAND, 1), 0x5000, 0x2120)]
    another_of_its_name(candump, player)


def another_of_its_name(candump: Candump, player: Player) -> None:
    """A bound identity asks again (D-BUS-6): parameter 1 is read from its id, an answer means that there are two.

    While the audit waits for an answer, that answer shows it as well (D-BUS-41), and parameter 1 is not read."""
    refused = f"322#8100{SERIAL['A']}"
    requests: list[str] = []
    while not requests:
        start = len(candump.lines)
        cansend(f"622#01{SERIAL['A']}")
        requests = play_device(candump, player, start, "030100", refused)
        candump.await_frame(refused, start)
    assert requests == ["030100"]
    start = len(candump.lines)
    cansend(f"611#01{SERIAL['A']}")
    candump.await_frame("311#030100", start)  # nobody answers: it was reset
    candump.await_frame(f"311#8111{SERIAL['A']}", start)


# --- trouble ---


def assert_quiet_without_interface(bench: Bench, limb: Limb, down_s: float) -> None:
    """All devices are lost, and later, when they have given up too, no process works; down since down_s."""
    until(lambda: limb.host.system_info().devices == 0, "all devices are lost", DEADLINE_S)
    time.sleep(max(0.0, down_s + ALONE_S + 0.5 - time.monotonic()))
    before = {name: cpu_ticks(pid) for name, pid in limb.pids().items()}
    time.sleep(QUIET_S)
    used = {name: cpu_ticks(pid) - before[name] for name, pid in limb.pids().items()}
    bench.say(f"ticks of 10 ms used in {QUIET_S:g} s without the interface: {used}")
    assert max(used.values()) <= QUIET_TICKS, used


def assert_back(bench: Bench, limb: Limb, what: str) -> None:
    started_s = time.monotonic()
    until(limb.is_linked, "all links are active again", DEADLINE_S)
    limb.await_values(5)
    bench.say(f"{what}: links active and values at D3 {time.monotonic() - started_s:.1f} s later")


def interface_down_and_up_is_survived(bench: Bench) -> None:
    """ip link set vcan0 down and up, at once and after the devices are lost: no restart, no processor time."""
    limb = Limb(bench)
    limb.link()
    limb.await_values(5)
    ids = limb.node_ids()
    run("ip", "link", "set", INTERFACE, "down")
    run("ip", "link", "set", INTERFACE, "up")
    assert_back(bench, limb, "down and up at once")
    run("ip", "link", "set", INTERFACE, "down")
    assert_quiet_without_interface(bench, limb, time.monotonic())
    run("ip", "link", "set", INTERFACE, "up")
    assert_back(bench, limb, "up after the devices were lost")
    assert limb.node_ids() == ids


def interface_deleted_and_made_again_is_survived(bench: Bench) -> None:
    """vcan0 is deleted for longer than ids are kept; the devices bind again and get their old ids and links."""
    limb = Limb(bench)
    limb.link()
    limb.await_values(5)
    ids = limb.node_ids()
    run("ip", "link", "del", INTERFACE)
    started_s = time.monotonic()
    assert_quiet_without_interface(bench, limb, started_s)
    time.sleep(max(0.0, started_s + IDS_KEPT_S - time.monotonic()))
    run("ip", "link", "add", "dev", INTERFACE, "type", "vcan")
    run("ip", "link", "set", INTERFACE, "up")
    assert_back(bench, limb, "made again")
    assert limb.node_ids() == ids


def restart_arbitrator(bench: Bench, memory: str) -> tuple[list[int], list[int]]:
    """Kills the arbitrator of a working limb and starts another. Returns the node ids before and after."""
    nvm = bench.folder / "nvm"
    limb = Limb(bench, "--nvm", nvm)
    limb.link()
    limb.await_values(5)
    before = limb.node_ids()
    limb.pdcpd.kill()
    limb.host.close()
    limb.pdcpd = bench.pdcpd("--nvm", bench.folder / memory)
    limb.host = bench.host()
    assert_back(bench, limb, "a new arbitrator")
    after = limb.node_ids()
    bench.say(f"node ids before {before}, after {after}; all {len(LINKS)} links came back by themselves")
    return before, after


def restarted_arbitrator_gets_its_devices_back(bench: Bench) -> None:
    """pdcpd is killed and started with the same --nvm: devices with their old ids, links and values by themselves."""
    before, after = restart_arbitrator(bench, "nvm")
    assert before == after


def new_arbitrator_takes_a_live_limb_over(bench: Bench) -> None:
    """pdcpd is killed and started with a blank --nvm: the devices know their links, and all works again."""
    _, after = restart_arbitrator(bench, "blank")
    assert len(set(after)) == len(after)


def full_transmit_queue_loses_nothing(bench: Bench) -> None:
    """A queue that is nearly always full (ENOBUFS) while devices bind, are linked and send: every frame gets out."""
    run("tc", "qdisc", "add", "dev", INTERFACE, "root", "netem", "delay", "8ms", "limit", "2")
    candump = bench.candump("0F0~7FF")
    flood = bench.program("cangen", INTERFACE, "-I", "0F0", "-L", "8", "-g", "5", "-i")
    limb = Limb(bench, sensor_rate_ms=50)
    limb.link()
    outputs = outputs_of(limb)
    enough = len(data_of(candump, outputs.wrist)) + 60
    until(lambda: len(data_of(candump, outputs.wrist)) >= enough, "60 more values from D2", 2 * DEADLINE_S)
    dropped = re.search(r"dropped (\d+)", run("tc", "-s", "qdisc", "show", "dev", INTERFACE))
    assert dropped is not None and int(dropped[1]) > 0, "the queue was never full"
    assert limb.is_linked(), limb.links()
    assert not flood.has_ended(), flood.errors
    flood.stop()
    # From now on there is room, and what waits in the queue still gets out.
    run("tc", "qdisc", "change", "dev", INTERFACE, "root", "netem", "delay", "8ms", "limit", "1000")
    limb.host.get_parameter(ChannelId(D1), PARAMETER_NODE_ID)  # the answer comes behind all that D1 had to send
    counters = {"d1": stats(limb.nodes["d1"])}
    bench.say(assert_whole(limb, candump, outputs, counters["d1"]["data_out"]))
    counters |= {name: stats(limb.nodes[name]) for name in ("d2", "d3")}
    refused = {name: each["sends_refused"] for name, each in counters.items()}
    bench.say(f"the queue refused {dropped[1]} frames; these refusals were of devices: {refused}")
    sent = {"d1": data_of(candump, outputs.sensor)}
    sent["d2"] = data_of(candump, outputs.wrist) + data_of(candump, outputs.grip)
    assert sum(refused.values()) > 0, "no frame of a device was ever refused"
    for name, frames in sent.items():
        assert counters[name]["data_out"] == len(frames), f"{name}: {len(frames)} on the bus, {counters[name]}"
    assert all(each["tx_full"] == 0 for each in counters.values()), counters


FLOOD = 1000
FLOOD_ID = "0F0"


def foreign_frames_do_not_wake_a_device(bench: Bench) -> None:
    """1000 frames that no device of the process listens to: next to no wake-ups, before it is bound and after."""
    candump = bench.candump(f"{FLOOD_ID}~7FF")  # all others, each of which may wake the process once or twice
    node = bench.node("--stats", bench.description("d1"), bench.description("d3"))
    pid = node.process.pid
    for device in (D1, D3):
        candump.await_frame(rf"6..#01{identity_hex(device)}")
    until(lambda: is_asleep(pid), "pdcp-node sleeps", DEADLINE_S)

    def flood(when: str) -> int:
        """Wake-ups, without those that the frames for the devices and their own account for."""
        shown, before, started_s = len(candump.texts()), wake_ups(pid), time.monotonic()
        run("cangen", INTERFACE, "-I", FLOOD_ID, "-L", "8", "-g", "1", "-n", str(FLOOD))
        woken, others = wake_ups(pid) - before, len(candump.texts()) - shown
        took_s = time.monotonic() - started_s
        bench.say(f"{when}: {woken} wake-ups in {took_s:.1f} s, in which {FLOOD} frames came, and {others} others")
        return woken - 2 * others

    alone = flood("without an arbitrator")
    bench.pdcpd()
    host = bench.host()
    until(lambda: host.system_info()[:3] == (2, 2, 1), "both devices are set up", DEADLINE_S)
    bound = flood("bound")
    frames = stats(node)["frames_received"]
    bench.say(f"frames received in all: {frames} of {2 * FLOOD} and {len(candump.texts())} others")
    assert alone < FLOOD // 10 and bound < FLOOD // 10
    assert frames < len(candump.texts()) + FLOOD // 2


TESTS = [
    limb_of_four_processes_agrees_with_candump,
    bind_request_by_hand_is_granted,
    bad_and_foreign_frames_are_not_answered,
    device_by_hand_is_set_up,
    arbitrator_beacons_each_500_ms,
    interface_down_and_up_is_survived,
    interface_deleted_and_made_again_is_survived,
    restarted_arbitrator_gets_its_devices_back,
    new_arbitrator_takes_a_live_limb_over,
    full_transmit_queue_loses_nothing,
    foreign_frames_do_not_wake_a_device,
]

if __name__ == "__main__":
    main(TESTS)
