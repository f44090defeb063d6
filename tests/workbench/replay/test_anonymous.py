"""Incidents without names. Such a file contains no name of the site. In a replay, the file gives the
same decisions as the original file."""

import re
import sys
from pathlib import Path

import pytest

from bridges.blackbox import mcap_write
from bridges.blackbox.entries import DaemonDied, Head, Spoken
from bridges.blackbox.incident import Incident, Note
from bridges.kinds import lift
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.messages import cdr
from bridges.messages.definitions import DiagnosticArray, LiftState, Time
from bridges.messages.releases import KILTED
from bridges.runtime.diagnostics import diagnosis
from tests.workbench.replay.test_replay import CORPUS
from workbench.replay.anonymous import ADDRESS, anonymous, our_words
from workbench.replay.files import opened
from workbench.replay.incidents import notes_in
from workbench.replay.replayed import Replay, ReplayedCores, of_head
from workbench.replay.sources import Notes

CONFIG = Path(__file__).parents[3] / "config"
NAMES = (b"Lift1", b"Lift2", b"red", b"green", b"white", b"black", b"bay1", b"bay2", b"ward", b"L3")


def whole(file: Path) -> Incident:
    """Return the content of a file, including its messages."""
    head, entries = opened(file, Notes())
    return Incident(head, list(entries), tuple(notes_in(file)))


@pytest.mark.parametrize("file", CORPUS, ids=lambda file: file.stem)
def test_an_anonymous_incident_is_decided_as_before_and_names_nobody(
    file: Path, tmp_path: Path
) -> None:
    hidden = anonymous(whole(file))
    written = tmp_path / "a.mcap"
    mcap_write.write(written, hidden)
    head, entries = opened(written, Notes())
    replay = Replay(entries, ReplayedCores(of_head(head)))

    assert list(replay.differences()) == []
    assert replay.course.decisions > 40
    told = [head.yaml, str(list(opened(written, Notes())[1])).encode()]
    assert [name for name in NAMES for text in told if _is_in(name, text)] == []


def _is_in(name: bytes, text: bytes) -> bool:
    return re.search(rb"(?<![\w])" + name + rb"(?![\w])", text) is not None


def test_a_name_is_the_same_in_messages_and_decisions_and_comments_and_addresses_go() -> None:
    yaml = (
        b"# Saint Mary's\nkind: lift_supervisor\n"
        b"rmf: {zenoh: {connect: [tcp/mary.local:7447]}, transport: zenoh}\n"
    )
    head = Head(
        "r", 1, "1", "lift_supervisor", "/home/mary.yaml", yaml, {}, False, {}, RecordingSettings()
    )
    state = LiftState(lift_name="East", current_floor="L1", session_id="fleet/joe")
    told = anonymous(Incident(head, [_spoken(state)]))

    assert told.head.yaml == b"kind: lift_supervisor\nrmf:\n  transport: zenoh\n"
    assert told.head.file == "/anonymous.yaml"
    [spoken] = told.entries
    assert isinstance(spoken, Spoken)
    assert b"East" not in spoken.cdr
    assert (
        spoken.cdr
        == _spoken(
            LiftState(lift_name="name1", current_floor="name2", session_id="fleet/name3")
        ).cdr
    )


def test_the_codes_of_faults_and_the_keys_of_diagnostics_stay() -> None:
    """Otherwise `explain` would have no remedy, and a replay would show other faults."""
    yaml = (CONFIG / "lift_dry_contact.yaml").read_bytes()
    file = "/home/mary/east.yaml"
    head = Head("r", 1, "1", "lift", file, yaml, {}, False, {}, RecordingSettings())
    detail = f"Lift1 waits for joe, enable {file}, /run/east/status"
    fault = {"faults": [{"code": "OVERLOAD", "detail": detail}], "session": "joe"}
    said = diagnosis("rmf_bridge_mary", "lift", {}, {"Lift1": fault}, Time(1))
    entry = _spoken(LiftState(lift_name="Lift1", session_id="joe")), _spoken(said)
    told = anonymous(Incident(head, [*entry])).entries[1]

    assert isinstance(told, Spoken)
    daemon, device = cdr.decode(type(said), told.cdr, KILTED).status
    name = device.hardware_id
    assert (daemon.name, daemon.values) == (f"{daemon.hardware_id}: daemon", said.status[0].values)
    assert device.name == f"{daemon.hardware_id}: {name}"
    values = {value.key: value.value for value in device.values}
    who = values["session"]
    stem = values["OVERLOAD"].split("/")[3]
    said_of = f"{name} waits for {who}, enable /anonymous.yaml, /run/{stem}/status"
    assert values == {"kind": "lift", "OVERLOAD": said_of, "session": who}
    real = {"rmf_bridge_mary", "Lift1", "joe", "east"}
    assert {daemon.hardware_id, name, who, stem}.isdisjoint(real)


def test_the_host_of_a_bus_is_hidden_in_the_texts_of_errors_too() -> None:
    yaml = (CONFIG / "door_modbus.yaml").read_text().replace("host: 192.168.1.50", "host: plc.mary")
    assert "plc.mary" in yaml
    head = Head("r", 1, "1", "door", "/d.yaml", yaml.encode(), {}, False, {}, RecordingSettings())
    note = Note(1.0, "FAULT", "DEVICE_LOST: plc.mary:502 does not answer", "ward")
    told = anonymous(Incident(head, [DaemonDied(1.0, "no answer of plc.mary")], (note,)))

    assert b"mary" not in told.head.yaml
    assert [one.reason for one in told.entries if isinstance(one, DaemonDied)] == [
        f"no answer of {ADDRESS}"
    ]
    assert told.notes[0].text == f"DEVICE_LOST: {ADDRESS}:502 does not answer"


def test_a_kind_whose_words_cannot_be_read_makes_nothing_anonymous(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """`anonymous` must know the fixed words of each kind of device, such as the names of its states.
    Otherwise it would replace these words like names of the site, and a replay would fail."""
    monkeypatch.setitem(sys.modules, lift.__name__ + ".report", None)
    our_words.cache_clear()

    with pytest.raises(ImportError):
        anonymous(whole(CORPUS[0]))


def _spoken(said: LiftState | DiagnosticArray) -> Spoken:
    told, topic = cdr.encode(type(said), said, KILTED), "lift_states"
    kind = "rmf_lift_msgs/msg/LiftState"
    if isinstance(said, DiagnosticArray):
        topic, kind = "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"
    return Spoken(1.0, True, topic, kind, "kilted", told)


def test_a_recording_without_names_and_path_stays_as_it_is() -> None:
    yaml = b"kind: lift_supervisor\n"
    head = Head("r", 1, "1", "lift_supervisor", "", yaml, {}, False, {}, RecordingSettings())
    told = anonymous(Incident(head, [DaemonDied(1.0, "no answer: a bus")]))
    assert (told.head.yaml, told.entries) == (yaml, [DaemonDied(1.0, "no answer: a bus")])
