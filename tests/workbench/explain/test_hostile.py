"""Hostile messages: floods of names, strange values, control characters. `explain` limits the harm and
reports such messages."""

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.messages.words import KINDS
from bridges.observe.limits import MOST_DEVICES, MOST_REQUESTERS
from workbench.explain.device import MOST_LINES
from workbench.explain.heard_devices import HeardDevices
from workbench.explain.lift_facts import LiftFacts
from workbench.explain.text import lines

WALL = 1_800_000_000.0
STATE = d.LiftState(
    lift_name="Lift1", current_floor="L1", available_floors=("L1", "L2"), current_mode=2
)
ESCAPE = "\x1b[2J\r\n\u202e"


def heard(at: float, topic: str, message: d.Message) -> Heard:
    return Heard(at, WALL + at, topic, message)


def test_a_flood_of_requesters_displaces_no_holder() -> None:
    site = HeardDevices()
    ask = d.LiftRequest("Lift1", stamp(WALL), "fleet/red", 1, "L2", 2)
    site.take(heard(0, "adapter_lift_requests", ask))
    for n in range(10 * MOST_REQUESTERS):
        state = replace(STATE, lift_time=stamp(WALL + n), session_id="fleet/red")
        site.take(heard(n / 100, "lift_states", state))
        made = replace(ask, session_id=f"made/up{n}")
        site.take(heard(n / 100, "adapter_lift_requests", made))
    told = site.explain("lift", "Lift1", None)
    assert any("fleet/red has had the lift" in sentence for sentence in told.now)
    lift = site.known["lift", "Lift1"]
    assert isinstance(lift, LiftFacts)
    assert len([*lift.requesters]) == MOST_REQUESTERS
    assert lift.requesters.get("fleet/red") is not None
    assert len(lift.lines) <= MOST_LINES
    assert len(lines(told)) <= 40


def test_a_flood_of_devices_is_bounded_and_the_first_ones_stay() -> None:
    site = HeardDevices()
    for n in range(20 * MOST_DEVICES):
        site.take(heard(0, "lift_states", replace(STATE, lift_name=f"made up {n}")))
    assert len(site.devices()) == MOST_DEVICES
    assert ("lift", "made up 0") in site.devices()


@pytest.mark.parametrize("kind", KINDS)
def test_terminal_escapes_in_names_are_shown_and_have_no_effect(kind: str) -> None:
    site = HeardDevices()
    name = f"x{ESCAPE}" + "y" * 5000
    said: dict[str, tuple[d.Message, d.Message]] = {
        "lift": (
            d.LiftState(lift_name=name, current_floor=ESCAPE, session_id=ESCAPE),
            d.LiftRequest(name, d.Time(), name, 1, name, 2),
        ),
        "door": (
            d.DoorState(d.Time(), name, d.DoorMode(77)),
            d.DoorRequest(d.Time(), name, name, d.DoorMode(2)),
        ),
        "charger": (
            d.ChargerState(d.Time(), 99, name, ESCAPE, name, name, name),
            d.ChargerRequest(name, name, name, d.Duration(), name),
        ),
    }
    for other, state_type, request_type in (
        ("dispenser", d.DispenserState, d.DispenserRequest),
        ("ingestor", d.IngestorState, d.IngestorRequest),
    ):
        said[other] = (
            state_type(d.Time(), name, 77, (name, ESCAPE)),
            request_type(d.Time(), name, name, name),
        )
    state, request = said[kind]
    for n in range(9):
        site.take(heard(n, f"{kind}_states", state))
        site.take(heard(n, f"adapter_{kind}_requests", request))
    ((found, _),) = site.devices()
    told = lines(site.explain(found, name, None))
    assert found == kind
    assert all(line.isprintable() for line in told)


@pytest.mark.parametrize("wall", [-1e18, -1.0, 0.0, 1e18, float("inf"), float("nan")])
def test_no_clock_in_a_recording_keeps_it_from_being_explained(wall: float) -> None:
    site = HeardDevices()
    site.take(Heard(0.0, wall, "lift_states", STATE))
    site.take(Heard(1.0, wall, "lift_states", STATE))
    assert lines(site.explain("lift", "Lift1", None))[0].startswith("lift Lift1, heard from ")


def test_a_clock_that_steps_changes_no_duration() -> None:
    site = HeardDevices()
    for n in range(60):
        wall = WALL + n + (3600.0 if n >= 30 else 0.0)
        site.take(Heard(float(n), wall, "lift_states", replace(STATE, lift_time=stamp(wall))))
    told = site.explain("lift", "Lift1", None)
    assert told.heard.endswith("(59 s)")
    assert any("stepped by +3600 s" in note for note in told.notes)
