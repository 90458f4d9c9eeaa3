"""A limb of separate processes that configures itself (profile-layer.md 4): no host is needed, one only looks."""

from contextlib import ExitStack
from pathlib import Path

import pytest
from programs import Pdcpd, Program, Value, until

from pdcp import Action, ChannelId, Client, Flags, Identity, LinkStatus
from pdcp.model import ProfileState

ROOT = Path(__file__).resolve().parents[2]
D1, D2, D3, D4 = (Identity(2, 2, serial) for serial in (4, 5, 6, 7))
OUT, SWITCH, MUSCLE = ChannelId(D1, 1), ChannelId(D2, 1), ChannelId(D2, 2)
WRIST, GRIP = ChannelId(D3, 1), ChannelId(D3, 2)
LINKS = {(OUT, MUSCLE), (ChannelId(D2, 3), WRIST), (ChannelId(D2, 5), GRIP)}
LINKS_SPARE = {(ChannelId(D4, 1), MUSCLE), (ChannelId(D2, 3), WRIST), (ChannelId(D2, 5), GRIP)}
BEACON_MS = 200

Links = set[tuple[ChannelId, ChannelId]]


class Limb:
    """pdcpd, a process for each part, and a host that looks."""

    def __init__(self, programs: Path, folder: Path, stack: ExitStack) -> None:
        self._programs = programs
        self._folder = folder
        self._stack = stack
        self.parts: dict[str, Program] = {}

    def start(self, *arguments: str | Path) -> None:
        words = ["--can", "sim:0", "--host", "pty", "--log", "info", *arguments]
        self.pdcpd = self._stack.enter_context(Pdcpd(self._programs, *words))
        self.host = self._stack.enter_context(Client(self.pdcpd.port()))

    def plug(self, *names: str) -> None:
        """Parts of tools/demo.d, that beacon fast and keep their parameters."""
        for name in names:
            path = self._folder / f"{name}.ini"
            text = (ROOT / "tools/demo.d" / f"{name}.ini").read_text(encoding="utf-8")
            head = f"[device]\nbeacon_ms = {BEACON_MS}\nstate = {name}.state\n"
            path.write_text(text.replace("[device]\n", head), encoding="utf-8")
            bus = f"socketcand:127.0.0.1:{self.pdcpd.bus_port()}/any"
            self.parts[name] = self._stack.enter_context(Program([self._programs / "pdcp-node", "--can", bus, path]))

    def pull(self, name: str) -> None:
        self.parts.pop(name).kill()

    def active(self) -> Links:
        return {(link.output, link.input) for link in self.host.links() if link.status is LinkStatus.ACTIVE}

    def await_links(self, links: Links) -> None:
        until(lambda: self.active() == links, f"links {links}")

    def await_values(self) -> None:
        """New values arrive at both inputs of the hand."""
        queue = self.parts["d3"].values
        while not queue.empty():
            queue.get()
        counts = {1: 0, 2: 0}

        def arrived() -> bool:
            while not queue.empty():
                value: Value = queue.get()
                counts[value.channel] += not value.safe
            return min(counts.values()) >= 5

        until(arrived, "5 values at each input of the hand")


@pytest.fixture
def limb(programs: Path, tmp_path: Path, stack: ExitStack) -> Limb:
    return Limb(programs, tmp_path, stack)


def test_a_limb_links_itself(limb: Limb) -> None:
    limb.start()
    limb.plug("d1", "d2", "d3")
    limb.await_links(LINKS)
    limb.await_values()
    info = limb.host.info()
    assert (info.profile_state, info.active, info.stored) == (ProfileState.RUNNING, 0, 0)


def test_no_autoconfig(limb: Limb) -> None:
    """The option takes effect and shows in the flags; the host may ask for it all the same."""
    limb.start("--no-autoconfig")
    limb.plug("d1", "d2", "d3")
    until(lambda: limb.host.info().profile_state is ProfileState.RUNNING, "the start-up is over")
    assert limb.host.links() == []
    assert limb.host.info().flags == Flags.HOT_SWAP
    assert limb.host.action(Action.AUTOCONFIGURE) == len(LINKS)
    assert limb.active() == LINKS
    limb.await_values()


def test_a_sensor_is_replaced_and_comes_back(limb: Limb) -> None:
    """The spare part takes nothing while the original is there, and gives its place back."""
    limb.start()
    limb.plug("d1", "d2", "d3")
    limb.await_links(LINKS)
    limb.plug("d4")
    until(lambda: len(limb.host.devices()) == 4, "the spare part is there")
    assert limb.active() == LINKS
    limb.pull("d1")
    limb.await_links(LINKS_SPARE)
    limb.await_values()
    limb.plug("d1")
    limb.await_links(LINKS)
    limb.await_values()


def test_a_saved_limb_is_there_after_a_restart(limb: Limb, tmp_path: Path, stack: ExitStack, programs: Path) -> None:
    """Everything is switched off and on; the configuration is that of the memory, and nothing is made up."""
    limb.start("--nvm", tmp_path / "nvm")
    limb.plug("d1", "d2", "d3")
    limb.await_links(LINKS)
    assert limb.host.link(ChannelId(D2, 4), GRIP) is LinkStatus.ACTIVE
    limb.host.action(Action.SAVE, 3)
    for name in list(limb.parts):
        limb.pull(name)
        (tmp_path / f"{name}.state").unlink()
    limb.host.close()
    assert limb.pdcpd.stop() == 0
    again = Limb(programs, tmp_path, stack)
    again.start("--nvm", tmp_path / "nvm", "--no-autoconfig")
    again.plug("d1", "d2", "d3")
    again.await_links({(OUT, MUSCLE), (ChannelId(D2, 3), WRIST)})  # 2.4 requires 2.1, which has no source
    assert again.host.info().active == 3
    assert again.host.link(OUT, MUSCLE) is LinkStatus.ACTIVE
