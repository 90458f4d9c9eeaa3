"""The five acceptance systems (profile-layer.md 6) with a process for each part, at power-on and as hot swaps.

    python -m tests.vm.systems_on_vcan PROGRAMS RESULTS [TEST]...

The host saves and looks; links are made by the limb, but for those of systems 1 and 4 that are to be there beforehand.
"""

import json
import time
from pathlib import Path

from programs import Pdcpd, Program, until

from pdcp import Action, ChannelId, Identity, LinkStatus
from tests.vm.bench import (
    D1,
    D2,
    D3,
    DEADLINE_S,
    DEVICES,
    LINKS,
    PARAMETER_NODE_ID,
    PARAMETER_OUTPUT_ID,
    ROOT,
    Bench,
    main,
)

Links = set[tuple[ChannelId, ChannelId]]

DEMO = ROOT / "tools/demo.d"
SYSTEMS = ROOT / "tests/sim/systems.d"


def link(output: Identity, number: int, input_: Identity, index: int) -> tuple[ChannelId, ChannelId]:
    return ChannelId(output, number), ChannelId(input_, index)


class System:
    """pdcpd with a memory, and parts that keep their parameters."""

    def __init__(self, bench: Bench, prefix: Path) -> None:
        """prefix: of the files of the parts, to which 1.ini and so on is added."""
        self.bench = bench
        self.prefix = prefix
        self.parts: dict[str, Program] = {}
        self.pdcpd: Pdcpd

    def start(self, memory: str = "nvm", autoconfig: bool = False) -> None:
        self.pdcpd = self.bench.pdcpd("--nvm", self.bench.folder / memory, autoconfig=autoconfig)
        self.host = self.bench.host()

    def stop(self) -> None:
        self.host.close()
        self.pdcpd.kill()

    def plug(self, *names: str) -> None:
        for name in names:
            text = Path(f"{self.prefix}{name.removeprefix('d')}.ini").read_text(encoding="utf-8")
            path = self.bench.folder / f"{name}.ini"
            path.write_text(text.replace("[device]\n", f"[device]\nstate = {name}.state\n"), encoding="utf-8")
            self.parts[name] = self.bench.node("--stats", path)

    def pull(self, *names: str) -> None:
        for name in names:
            self.parts.pop(name).kill()

    def forget(self, *names: str) -> None:
        """What parts that are not plugged in keep."""
        for name in names:
            (self.bench.folder / f"{name}.state").unlink(missing_ok=True)

    def active(self) -> Links:
        return {(each.output, each.input) for each in self.host.links() if each.status is LinkStatus.ACTIVE}

    def await_links(self, links: Links, what: str) -> None:
        started_s = time.monotonic()
        until(lambda: self.active() == links, f"{what}: links {links}", DEADLINE_S)
        self.bench.say(f"{what}: linked, {time.monotonic() - started_s:.1f} s later")

    def await_values(self) -> None:
        """At both inputs of the hand, of which those of D3 print what arrives."""
        values = self.parts["d3"].values
        while not values.empty():
            values.get()
        counts = {1: 0, 2: 0}

        def arrived() -> bool:
            while not values.empty():
                value = values.get()
                counts[value.channel] += not value.safe
            return min(counts.values()) >= 5

        until(arrived, "values arrive at both inputs of D3", DEADLINE_S)

    def assert_received(self, name: str, output: ChannelId) -> None:
        """A part without terminal inputs has received values of an output."""
        candump = self.bench.candump()
        (output_id,) = self.host.get_parameter(output, PARAMETER_OUTPUT_ID)
        candump.await_frame(f"0{output_id:02X}#.*")
        # It takes its frames in order: when it answers, it has that one.
        self.host.get_parameter(ChannelId(DEVICES[name]), PARAMETER_NODE_ID)
        part = self.parts.pop(name)
        assert part.stop() == 0, part.errors
        count = json.loads(part.errors[-1])["data_in"]
        self.bench.say(f"{count} values have arrived at {name}")
        assert count > 0


def replaced_part(bench: Bench, number: int, before: Links, after: Links) -> None:
    """Systems 1 and 4: a linked part is replaced by one that is like it."""
    lost, new = ("d2", "d3") if number == 1 else ("d1", "d2")
    stays = "d1" if number == 1 else "d3"
    system = System(bench, SYSTEMS / f"{number}-d")
    system.start()
    system.plug(stays, lost)
    until(lambda: len(system.host.devices()) == 2, "both parts are there", DEADLINE_S)
    for output, input_ in before:
        assert system.host.link(output, input_) is LinkStatus.ACTIVE
    system.host.action(Action.SAVE)
    system.pull(lost)
    system.plug(new)
    system.await_links(after, "hot swap")
    system.pull(stays, new)
    system.stop()
    system.start()
    system.plug(stays, new)
    system.await_links(after, "power-on")
    assert system.host.info().active == 1
    ((output, _),) = after
    system.assert_received("d3", output)


def system_1(bench: Bench) -> None:
    """D1.1 to D2.1 saved, D2 replaced by D3: D1.1 to D3.2."""
    replaced_part(bench, 1, {link(D1, 1, D2, 1)}, {link(D1, 1, D3, 2)})


def system_4(bench: Bench) -> None:
    """D1.1 to D3.2 saved, D1 replaced by D2: D2.2 to D3.2."""
    replaced_part(bench, 4, {link(D1, 1, D3, 2)}, {link(D2, 2, D3, 2)})


def system_2(bench: Bench) -> None:
    """Nothing stored: the limb links itself, and a part that is pulled and plugged is linked again."""
    system = System(bench, DEMO / "d")
    system.start(autoconfig=True)
    system.plug("d1", "d2", "d3")
    system.await_links(LINKS, "power-on")
    system.await_values()
    system.pull("d2")
    until(lambda: system.active() == set(), "the links rest", DEADLINE_S)
    system.plug("d2")
    system.await_links(LINKS, "hot swap of D2")
    system.await_values()


def system_3(bench: Bench) -> None:
    """Configured, saved, everything reset: restored from storage. The parts have forgotten, nothing is made up."""
    parts = ("d1", "d2", "d3")
    system = System(bench, DEMO / "d")
    system.start(autoconfig=True)
    system.plug(*parts)
    system.await_links(LINKS, "configured")
    system.host.action(Action.SAVE)
    system.pull(*parts)
    system.stop()
    system.forget(*parts)
    system.start()
    system.plug(*parts)
    system.await_links(LINKS, "power-on")
    assert system.host.info().active == 1
    system.await_values()
    system.pull("d1", "d3")
    until(lambda: system.active() == set(), "the links rest", DEADLINE_S)
    system.forget("d1", "d3")
    system.plug("d1", "d3")
    system.await_links(LINKS, "hot swap of D1 and D3")
    system.await_values()


def system_5(bench: Bench) -> None:
    """The arbitrator is replaced by a blank one: read back from the devices, and data flows on all three links."""
    parts = ("d1", "d2", "d3")
    system = System(bench, DEMO / "d")
    system.start(autoconfig=True)
    system.plug(*parts)
    system.await_links(LINKS, "configured")
    system.stop()
    system.start("blank")
    system.await_links(LINKS, "hot swap of the arbitrator")
    system.await_values()
    system.pull(*parts)
    system.stop()
    system.start("blank too")
    system.plug(*parts)
    system.await_links(LINKS, "power-on")
    assert (system.host.info().active, system.host.info().stored) == (0, 0)
    system.await_values()


TESTS = [system_1, system_2, system_3, system_4, system_5]

if __name__ == "__main__":
    main(TESTS)
