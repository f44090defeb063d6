"""The publisher's name for each recorded message, in the ring and in the recording's file."""

from pathlib import Path

from bridges.blackbox import mcap_write
from bridges.blackbox.entries import AnyEntry, Clocks, Head, Spoken
from bridges.blackbox.incident import Incident
from bridges.blackbox.mcap_write import MOST_CHANNELS
from bridges.blackbox.ring import Ring
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.messages.definitions import LiftState
from bridges.messages.heard import Heard, Sender
from bridges.messages.releases import KILTED
from bridges.runtime.clock import Clock
from bridges.runtime.ring_writer import RingWriter
from tests.workbench.page.recorded import _spoken
from workbench.replay.anonymous import anonymous
from workbench.replay.bags import heard_in

HEAD = Head(
    *("run", 1, "1", "lift_supervisor", "/etc/a.yaml", b"kind: lift_supervisor\n"),
    *({}, False, {}, RecordingSettings()),
)
OWN, OTHER = "/rmf_bridge_Lift1", "/rmf_bridge_lift_north"


def in_file(path: Path, *entries: AnyEntry) -> list[Heard]:
    """Write entries as the recorder does, and read them as `explain` does."""
    mcap_write.write(path, Incident(HEAD, [Clocks(0.0, 1e9), *entries]))
    return list(heard_in(path))


def said(node: str, *, sent: bool = False, at: int = 0, lift: str = "Lift1") -> Spoken:
    spoken = _spoken(at, sent, "lift_states", LiftState(lift_name=lift))
    return Spoken(spoken.at, sent, spoken.topic, spoken.type, "jazzy", spoken.cdr, node)


def nodes(heard: list[Heard]) -> list[str | None]:
    return [one.sender.node if one.sender else None for one in heard]


def test_the_ring_and_the_file_name_each_publisher(tmp_path: Path) -> None:
    """Discovery may give a node's name after the node's first message, but before the ring is
    written."""
    clock = Clock(lambda: 0.0, lambda: 1e9)
    writer = RingWriter(lambda: Ring(tmp_path, HEAD, 100_000), clock, lambda: KILTED)
    found_later, unknown = Sender(), Sender()
    for sent, sender in ((True, Sender(OWN)), (False, found_later), (False, unknown)):
        writer.spoken("lift_states", LiftState(), sent=sent, sender=sender)
    writer.spoken("lift_states", LiftState(), sent=False)
    found_later.node = OTHER
    writer.flush()
    in_ring = list(heard_in(tmp_path / "ring"))
    entries = [said(OWN, sent=True), said(OTHER), said(""), said("")]
    assert nodes(in_ring) == nodes(in_file(tmp_path / "a.mcap", *entries))
    assert nodes(in_ring) == [OWN, OTHER, None, None]


def test_a_node_is_one_publisher_and_a_namesake_of_the_daemon_another(tmp_path: Path) -> None:
    heard = in_file(tmp_path / "a.mcap", said(OWN, sent=True), said(OWN), said(OWN, sent=True))
    own, other, again = (one.sender for one in heard)
    assert (own is again, own is other) == (True, False)


def test_a_flood_of_made_up_nodes_leaves_every_message_readable(tmp_path: Path) -> None:
    flood = [said(f"/node{number}", at=number) for number in range(12_000)]
    heard = in_file(tmp_path / "a.mcap", *flood)
    assert len(heard) == len(flood)
    assert sum(one.sender is not None for one in heard) <= MOST_CHANNELS


def test_an_anonymous_recording_names_no_node() -> None:
    told = anonymous(Incident(HEAD, [said("/saint_marys/lift_north", lift="lift_north")]))
    [spoken] = told.entries
    assert isinstance(spoken, Spoken)
    assert spoken.node == "/name3/name2"  # name1 is the YAML
