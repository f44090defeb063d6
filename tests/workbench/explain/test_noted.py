"""Notes about a device in the incident files that our recorder writes. The daemon of the device makes
these notes, for example about relays and faults."""

import json
from pathlib import Path

import pytest

from bridges.messages import definitions as d
from bridges.messages.heard import Heard, Own
from bridges.runtime.diagnostics import diagnosis
from workbench.explain.device_timeline import Drawing
from workbench.explain.heard_devices import HeardDevices
from workbench.explain.noted import MOST, Noted, levels, noted
from workbench.explain.timeline import Level
from workbench.replay.recordings import RecordingSpan as Part
from workbench.replay.recordings import told_between

CORPUS = Path(__file__).parents[1] / "replay" / "corpus"


def test_an_incident_of_our_own_has_relays_inputs_and_faults() -> None:
    drawing = Drawing("lift", "Lift1")
    for one in told_between(CORPUS / "Lift1_1.mcap", Part(None, None), "test", "Lift1"):
        drawing.take(one)
    rows = [(lane.name, lane.row) for lane in drawing.timeline().lanes]
    assert [row for row in rows if row[0] in ("relays", "inputs", "faults")] == [
        ("relays", "agv_request"),
        ("relays", "hold_door"),
        ("inputs", "level"),
        ("inputs", "door"),
        ("inputs", "agv"),
        ("inputs", "floor_valid"),
        ("faults", "RMF_SILENT"),
    ]


def test_an_incident_says_what_its_daemon_refused_and_which_fault_it_has() -> None:
    site = HeardDevices("Lift1")
    for one in told_between(CORPUS / "Lift1_1.mcap", Part(None, None), "test", "Lift1"):
        site.take(one)
    told = site.explain("lift", "Lift1", None)
    assert [fault.code for fault in told.faults] == ["RMF_SILENT"]
    assert not told.notes


def test_a_fault_that_is_noted_and_then_published_on_the_graph_is_shown_once() -> None:
    site = HeardDevices("Lift1")

    def state(at: float) -> Heard:
        return Heard(
            at, at, "lift_states", d.LiftState(lift_time=d.Time(int(at)), lift_name="Lift1")
        )

    def noted_at(at: float, *codes: str) -> Own:
        found = [{"code": code, "detail": ""} for code in codes]
        text = json.dumps({"subject": "Lift1", "faults": found})
        return Own(at, at, "rmf_bridge/faults", text)

    def said_at(at: float, *codes: str) -> Heard:
        found = [{"code": code, "detail": ""} for code in codes]
        told = diagnosis("node", "lift", {}, {"Lift1": {"faults": found}}, d.Time(int(at)))
        return Heard(at, at, "diagnostics", told)

    story: list[Heard | Own] = [
        said_at(11, "FIRE"),
        noted_at(12, "FIRE"),
        said_at(13, "FIRE"),
        noted_at(14),
        said_at(15),
        noted_at(16, "MANUAL"),
        said_at(17, "MANUAL"),
        noted_at(18),
    ]
    site.take(state(10))
    for each in story:
        site.take(each)
    site.take(state(19))
    told = site.explain("lift", "Lift1", None)
    assert [line.text for line in told.story if "fault" in line.text] == [
        "fault FIRE",
        "fault FIRE is over",
        "fault MANUAL",
        "fault MANUAL is over",
    ]


def test_notes_become_levels_when_they_change() -> None:
    on: dict[tuple[str, str], str] = {}
    first = [*levels(1, Noted("Lift1", outputs={"call": "L2", "agv_request": "on"}), on)]
    same = [*levels(2, Noted("Lift1", outputs={"call": "L2", "agv_request": "on"}), on)]
    after = [*levels(3, Noted("Lift1", outputs={"call": "", "agv_request": "on"}), on)]
    faults = [*levels(4, Noted("Lift1", faults={"FIRE": "FIRE"}), on)]
    over = [*levels(5, Noted("Lift1", faults={}), on)]
    assert (first, same, after, faults, over) == (
        [Level(1, "relays", "call", "L2"), Level(1, "relays", "agv_request", "on")],
        [],
        [Level(3, "relays", "call", "")],
        [Level(4, "faults", "FIRE", "FIRE")],
        [Level(5, "faults", "FIRE", "")],
    )


@pytest.mark.parametrize(
    "text",
    ["", "[", "[]", "7", '{"subject":7}', '{"outputs":{}}', "[" * 100_000, '{"subject":"a"}x'],
)
def test_a_text_of_another_shape_is_not_a_note(text: str) -> None:
    assert noted("outputs", text) is None


@pytest.mark.parametrize("held", ["7", "[1]", '"x"', "null", '{"a":[],"b":{"=":7},"c":1.5,"":"x"}'])
def test_values_of_another_shape_are_left_out(held: str) -> None:
    note = noted("outputs", f'{{"subject":"Lift1","outputs":{held}}}')
    assert note == Noted("Lift1", outputs={})


def test_a_note_of_very_many_values_is_bounded() -> None:
    held = ",".join(f'"o{n}":true' for n in range(10_000))
    note = noted("outputs", f'{{"subject":"Lift1","outputs":{{{held}}}}}')
    assert note is not None
    assert note.outputs is not None
    assert len(note.outputs) == MOST
