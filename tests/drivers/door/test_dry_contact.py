"""The dry-contact door: its YAML, its wiring table, and its points."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.settings import DoorDurations, Pulse
from bridges.kinds.door.signals import DoorOutputs, DoorSample
from bridges.settings.load import load
from drivers.door.dry_contact import create, debounce, warnings, wires
from drivers.hal.points import Flash, HalError, Wire
from hal_fakes.plants.door import build
from tests.drivers.far import PointsFar
from tests.drivers.hal.modbus.module import Time
from tests.kinds.door.virtual import FIRE, OBSTRUCTION, Door, settings

CONFIG = Path(__file__).parents[3] / "config"
NONE: dict[str, Any] = {}
FLASHED = {"point": "unit 1 coil 0", "active": "high", "flash": "unit 1 coil 0x200"}


class Noted(PointsFar):
    """A bus that records each write to its module."""

    def __init__(self, *place: Any) -> None:
        super().__init__(*place)
        self.written: list[dict[str, bool]] = []

    def drive(self, levels: Mapping[str, bool]) -> None:
        self.written.append(dict(levels))
        super().drive(levels)


def gpio(point: str, active: str, pull: str) -> dict[str, Any]:
    return {"point": point, "active": active, "pull": pull}


def problems(**changes: Any) -> list[tuple[str, str]]:
    return [(".".join(path), text) for path, text in settings(**changes).problems()]


def test_a_door_with_both_contacts_has_no_problem() -> None:
    assert problems() == []
    assert problems(inputs={"obstruction": OBSTRUCTION, "fire": FIRE}, on_fire="open") == []


def test_the_shipped_door_is_sound() -> None:
    config = load(CONFIG / "door_modbus.yaml")
    assert [w.text.partition(" when ")[0] for w in config.warnings] == [
        "warning: bus 'module': unit 1 keeps its outputs"
    ]
    assert list(config.devices) == ["ward_door"]


@pytest.mark.parametrize(
    ("changes", "where", "text"),
    [
        (
            {"pulse": {"on_s": 3.0, "every_s": 3.0}},
            "pulse.on_s",
            "must be shorter than every_s; delete pulse if the relay must stay on",
        ),
        (
            {"inputs": {"opened": NONE}},
            "inputs",
            "needs 'opened'; if the door has no such contact, write feedback: estimated",
        ),
        (
            {"limits": {"open_delay_s": 3.0}},
            "limits.open_delay_s",
            "has an effect only with feedback: estimated; otherwise contacts show an open door",
        ),
        (
            {"feedback": "estimated", "limits": {"open_delay_s": 3.0}},
            "feedback",
            "both limit contacts are wired: delete feedback",
        ),
        (
            {"feedback": "estimated", "inputs": {"opened": NONE}},
            "limits",
            "feedback: estimated needs open_delay_s, the time the door takes to open",
        ),
        (
            {
                "feedback": "estimated",
                "inputs": {"opened": NONE},
                "limits": {"open_delay_s": 9.0, "travel_s": 8.0},
            },
            "limits.open_delay_s",
            "must not be longer than travel_s",
        ),
        (
            {"inputs": {"fire": FIRE}},
            "inputs.fire",
            "give the effect of a fire alarm: on_fire: open, or on_fire: release",
        ),
        (
            {"on_fire": "open"},
            "on_fire",
            "there is no fire input; wire a fire input under inputs, or delete on_fire",
        ),
        (
            {"outputs": {"hold_open": FLASHED}},
            "outputs.hold_open.flash",
            "is for pulses: write pulse: {on_s: …, every_s: …}, or delete flash",
        ),
        (
            {"outputs": {"hold_open": FLASHED}, "pulse": {"on_s": 0.75, "every_s": 3.0}},
            "pulse.on_s",
            "with flash the module counts in tenths of a second, so 0.75 s is impossible: write a"
            " multiple of 0.1",
        ),
    ],
)
def test_an_impossible_setting_is_named_with_its_fix(
    changes: dict[str, Any], where: str, text: str
) -> None:
    assert problems(**changes) == [(where, text)]


@pytest.mark.parametrize(
    ("signal", "contact", "text"),
    [
        ("opened", {**FIRE, "active": "low"}, "with its wire cut, the door reads open"),
        ("opened", gpio("BCM4", "high", "up"), "with its wire cut, the door reads open"),
        (
            "opened",
            gpio("BCM4", "high", "none"),
            "a cut wire floats (pull: none), and the door reads open",
        ),
        ("fire", {**FIRE, "active": "high"}, "with its wire cut, a fire alarm reads clear"),
        (
            "obstruction",
            {**FIRE, "active": "high"},
            "with its wire cut, somebody in the doorway is not seen",
        ),
    ],
)
def test_a_contact_whose_cut_wire_reads_as_a_safe_state_is_refused_unless_accepted(
    signal: str, contact: dict[str, Any], text: str
) -> None:
    rest: dict[str, Any] = {"on_fire": "open"} if signal == "fire" else {}
    assert problems(inputs={signal: contact}, **rest) == [
        (
            f"inputs.{signal}",
            f"unsafe: {text}; or accept_unsafe: {{{signal}: <why it is safe here>}}",
        )
    ]
    accepted = settings(inputs={signal: contact}, accept_unsafe={signal: "as built"}, **rest)
    assert list(accepted.problems()) == list(warnings(accepted)) == []


def test_a_relay_that_is_on_from_power_on_is_refused() -> None:
    relay = {"hold_open": {"point": "BCM17", "active": "low"}}
    [(where, text)] = problems(outputs=relay)
    assert (where, text.startswith("unsafe: BCM17 = J8:11 is pulled low from power-on")) == (
        "outputs.hold_open",
        True,
    )


def test_accepting_wiring_that_is_not_unsafe_is_warned_of() -> None:
    door = settings(accept_unsafe={"opened": "as built"})
    text = "nothing is unsafe about opened: delete this entry"
    assert list(warnings(door)) == [(("accept_unsafe", "opened"), text)]


def test_a_closed_contact_that_a_cut_wire_imitates_is_warned_of() -> None:
    inverted = {"point": "unit 1 discrete input 1", "active": "low"}
    text = "a cut wire may read as a closed door; use a contact that a closed door closes"
    assert list(warnings(settings(inputs={"closed": inverted}))) == [(("inputs", "closed"), text)]
    assert list(warnings(settings())) == []


def test_estimated_feedback_is_warned_of() -> None:
    door = settings(feedback="estimated", inputs={"opened": NONE}, limits={"open_delay_s": 4.0})
    text = "RMF gets OPEN and CLOSED after fixed times, whatever the door really does"
    assert list(warnings(door)) == [(("feedback",), text)]


def test_the_wiring_table_has_every_point_with_its_debounce() -> None:
    plain = {"point": "unit 1 discrete input 1", "active": "high"}
    door = settings(inputs={"closed": plain, "obstruction": OBSTRUCTION})
    assert wires(door) == [
        Wire(
            "opened",
            "in",
            "unit 1 discrete input 0",
            "high",
            debounce_s=0.0625,
            path=("inputs", "opened"),
        ),
        Wire(
            "closed",
            "in",
            "unit 1 discrete input 1",
            "high",
            debounce_s=0.05,
            path=("inputs", "closed"),
        ),
        Wire(
            "obstruction",
            "in",
            "unit 1 discrete input 2",
            "low",
            debounce_s=0.0625,
            path=("inputs", "obstruction"),
        ),
        Wire("hold_open", "out", "unit 1 coil 0", "high", path=("outputs", "hold_open")),
    ]
    assert debounce(door) == {"opened": 0.0625, "closed": 0.05, "obstruction": 0.0625}


def test_a_relay_whose_pulses_the_module_times_has_them_in_the_wiring_table() -> None:
    door = settings(outputs={"hold_open": FLASHED}, pulse={"on_s": 0.7, "every_s": 3.0})
    assert list(door.problems()) == list(warnings(door)) == []
    assert wires(door)[-1] == Wire(
        "hold_open",
        "out",
        "unit 1 coil 0",
        "high",
        path=("outputs", "hold_open"),
        flash=Flash("unit 1 coil 0x200", 0.7),
    )


def test_the_cores_limits_are_those_of_the_yaml() -> None:
    door = settings(
        inputs={"fire": FIRE}, on_fire="open", pulse={"on_s": 0.5, "every_s": 3.0}, limits={}
    )
    assert DoorLimits.of(door, debounce(door)) == DoorLimits(
        t=DoorDurations(),
        debounce={"opened": 0.0625, "closed": 0.0625, "fire": 0.0625},
        on_fire="open",
        pulse=Pulse(on_s=0.5, every_s=3.0),
    )


def test_polarity_is_applied_at_the_wire_and_the_sample_has_none() -> None:
    door = Door(inputs={"obstruction": OBSTRUCTION})
    assert door.driver.read() == DoorSample(opened=False, closed=True, obstruction=False)
    door.plant.press("obstruction", True, 1.0)
    assert door.driver.read() == DoorSample(opened=False, closed=True, obstruction=True)


def test_an_output_is_written_when_it_differs_and_again_after_a_failed_reading() -> None:
    built = settings()
    bus = Noted(Time(), build("door", built, wires(built)), wires(built))
    driver = create("door", built, bus)
    driver.open()
    bus.written.clear()
    driver.write(DoorOutputs(hold_open=True))
    driver.write(DoorOutputs(hold_open=True))
    assert bus.written == [{"unit 1 coil 0": True}]
    bus.down = "no reply"
    with pytest.raises(HalError):
        driver.read()
    bus.down = ""
    driver.write(DoorOutputs(hold_open=True))
    assert bus.written == [{"unit 1 coil 0": True}] * 2
    driver.make_safe()
    driver.close()
    assert bus.written[2:] == [{"unit 1 coil 0": False}] * 2
