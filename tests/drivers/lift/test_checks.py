"""The findings of `check` in a lift's wiring: errors, warnings, and unsafe wiring.

A file may accept unsafe wiring with the name of its signal in `accept_unsafe`.
"""

from pathlib import Path
from typing import Any

import pytest

from bridges.kinds.lift.signals import Hazard
from bridges.settings.load import load
from drivers.lift.dry_contact import DryContactLiftSettings, notes, warnings
from tests.drivers.lift.wirings import alarm, bits, coil, inputs, line, settings, whole

CONFIG = Path(__file__).parents[3] / "config" / "lift_dry_contact.yaml"


def found(wired: DryContactLiftSettings) -> list[tuple[str, str]]:
    return [(".".join(path), text) for path, text in wired.problems()]


def warned(wired: DryContactLiftSettings) -> list[tuple[str, str]]:
    return [(".".join(path), text) for path, text in warnings(wired)]


def test_the_shipped_example_is_right_and_warns_of_nothing() -> None:
    assert load(CONFIG).warnings == ()


def test_a_wiring_that_is_right_has_no_problem_and_no_warning() -> None:
    assert (found(settings()), warned(settings())) == ([], [])


def binary(**changes: Any) -> dict[str, Any]:
    code = {"encoding": "binary", "bits": bits(3), "codes": {1: "B1", 2: "G", 4: "1"}}
    return {"floor_code": {**code, **changes}}


def calls_by(codes: dict[int, str], pin: str = "") -> dict[str, Any]:
    """Return calls as a number on coils, or on pins whose names begin with `pin`."""
    lines = [coil(n) | ({"point": f"{pin}{n}"} if pin else {}) for n in (20, 21, 22)]
    return {"calls": {}, "call_code": {"bits": lines, "codes": codes}}


TWO_FLOORS = {"B1": {}, "G": {}, "1": {}, "G_r": {"level": "G", "side": "rear"}}
REAR = {"rear_door_opened": line(50), "rear_door_closed": line(51)}
SERVICE_CODES = {0: "normal", 1: "agv_mode", 2: "fire_alarm"}
ACCEPTED_SERVICE = dict.fromkeys(("service_bit0", "service_bit1"), "a test")
SERVICE = {"bits": bits(2, 60), "codes": SERVICE_CODES}

WRONG: list[tuple[dict[str, Any], list[tuple[str, str]]]] = [
    (
        {"floors": {**TWO_FLOORS, "Ground": {"level": "G"}}, "inputs": inputs(**REAR)},
        [
            ("floors.Ground", "Ground and G are the same door of landing G"),
            ("outputs", "no rear_door_open, but some floors have side: rear"),
        ],
    ),
    (
        {"floors": [], "calls": {}, "floor_code": {"encoding": "gray"}},
        [
            ("floors", "no floors: list this lift's floors by their names on RMF's map"),
            ("floor_code", "no bits: list the lines, least significant first"),
        ],
    ),
    ({"floors": ["B1", "G", "1", "G"]}, [("floors", "a floor is named twice: delete one")]),
    (
        {"floor_code": {"encoding": "one_hot", "lines": {"B1": line(20), "L9": line(21)}}},
        [
            ("floor_code.lines", "'L9' is not a landing of this lift, which has B1, G, 1"),
            ("floor_code.lines", "no line for G"),
            ("floor_code.lines", "no line for 1"),
        ],
    ),
    (
        {"floor_code": {**whole()["floor_code"], "bits": bits(2)}},
        [("floor_code", "one_hot has lines, and no bits, codes or parity")],
    ),
    (
        binary(lines={"B1": line(40)}),
        [("floor_code.lines", "binary needs bits and codes; only one_hot has lines")],
    ),
    (
        binary(codes={1: "B1", 2: "G", 3: "L9"}),
        [
            ("floor_code.codes", "'L9' is not a landing of this lift, which has B1, G, 1"),
            ("floor_code.codes", "no code for 1"),
        ],
    ),
    (
        binary(codes={1: "B1", 2: "G", 8: "1"}),
        [("floor_code.codes.8", "8 does not fit on 3 lines in binary")],
    ),
    (
        binary(codes={0: "B1", 2: "G", 4: "1"}, between_floors=[0, 9]),
        [
            ("floor_code.between_floors.9", "9 does not fit on 3 lines in binary"),
            (
                "floor_code.codes.0",
                "0 is B1 here, but is also in between_floors: write between_floors: [9]",
            ),
        ],
    ),
    ({"calls": {"B1": coil(2), "G": coil(3)}}, [("calls", "no call for 1")]),
    (
        {"call_code": {"bits": [coil(20), coil(21)], "codes": {1: "B1", 2: "G", 3: "1"}}},
        [("calls", "calls and call_code are alternatives: delete one of the two")],
    ),
    (
        {"calls": {}, "call_code": {"bits": [coil(20)], "codes": {0: "B1", 1: "G", 2: "1"}}},
        [
            ("call_code.codes.0", "0 is no call"),
            ("call_code.codes.2", "2 does not fit on the bits"),
        ],
    ),
    (
        calls_by({1: "B1", 2: "G", 3: "1", 4: "1"}),
        [("call_code.codes.4", "1 is called by 3 already: give each landing one number")],
    ),
    (
        {"inputs": inputs(door_opened=None, door_closed=None)},
        [("inputs", "no contact of this door: give door, or both door_opened and door_closed")],
    ),
    (
        {"inputs": inputs(door_closed=None)},
        [
            (
                "inputs.door_opened",
                "is the only contact of this door: write door: {…, proves: open} instead",
            )
        ],
    ),
    (
        {"inputs": inputs(door=line(40, proves="open"))},
        [
            (
                "inputs.door",
                "door is for a door with only one contact: delete door, or the other contacts",
            )
        ],
    ),
    (
        {"inputs": inputs(**REAR)},
        [("inputs", "a rear door is wired, but no floor has side: rear")],
    ),
    (
        {"floors": TWO_FLOORS, "outputs": {"rear_door_open": coil(5)}},
        [
            (
                "inputs",
                "no contact of this door: give rear_door, or both rear_door_opened and"
                " rear_door_closed",
            )
        ],
    ),
    (
        {"inputs": inputs(up=line(40))},
        [
            (
                "inputs.up",
                "the motion needs either moving, or stopped, or motion, or both up and down; not up",
            )
        ],
    ),
    (
        {"inputs": inputs(motion={"bits": bits(1, 40), "codes": {0: "stopped", 2: "up"}})},
        [
            (
                "inputs.motion.codes",
                "needs a code for stopped; it also needs either one for moving, or both up and down",
            ),
            ("inputs.motion.codes.2", "2 does not fit on the bits"),
        ],
    ),
    (
        {
            "inputs": inputs(service={**SERVICE, "codes": {**SERVICE_CODES, 3: "normal"}}),
            "accept_unsafe": ACCEPTED_SERVICE,
        },
        [
            (
                "inputs.agv_mode",
                "service has a code for agv_mode too: delete this input, or that code",
            )
        ],
    ),
    (
        {"inputs": inputs(agv_mode=None, service=SERVICE), "accept_unsafe": ACCEPTED_SERVICE},
        [("inputs.service.codes", "3 is missing: write its meaning")],
    ),
    (
        {"inputs": inputs(agv_mode=None, service={**SERVICE, "bits": bits(1, 60)})},
        [("inputs.service.codes.2", "2 does not fit on the bits")],
    ),
    (
        {"inputs": inputs(agv_mode=line(1, valid_when="agv_mode"))},
        [("inputs.agv_mode", "agv_mode itself shows AGV mode: delete valid_when")],
    ),
    (
        {"inputs": inputs(agv_mode=None, moving=line(40, valid_when="agv_mode"))},
        [("inputs.moving", "valid_when: agv_mode needs an agv_mode input")],
    ),
]


@pytest.mark.parametrize(("changes", "problems"), WRONG)
def test_a_wiring_that_cannot_be_right_is_refused(
    changes: dict[str, Any], problems: list[tuple[str, str]]
) -> None:
    assert found(settings(**changes)) == problems


def pin(point: str, active: str, **more: Any) -> dict[str, Any]:
    return {"point": point, "active": active, **more}


def floating(number: int) -> dict[str, Any]:
    return pin(f"BCM{number}", "high", pull="none")


def one_door(proves: str, **more: Any) -> dict[str, Any]:
    return inputs(door_opened=None, door_closed=None, door={"proves": proves, **more})


UNSAFE: list[tuple[str, dict[str, Any], str, str]] = [
    (
        "fire_alarm",
        {"inputs": inputs(fire_alarm=line(0))},
        "inputs.fire_alarm",
        "with its wire cut, a fire alarm reads clear",
    ),
    (
        "fire_alarm",
        {"inputs": inputs(fire_alarm=floating(4))},
        "inputs.fire_alarm",
        "a cut wire floats (pull: none), and a fire alarm reads clear",
    ),
    (
        "agv_mode",
        {"inputs": inputs(agv_mode=alarm(1))},
        "inputs.agv_mode",
        "with its wire cut, AGV mode reads on",
    ),
    (
        "door",
        {"inputs": one_door("open", **alarm(2))},
        "inputs.door",
        "with its wire cut, the door reads open",
    ),
    (
        "door",
        {"inputs": one_door("closed", **line(2))},
        "inputs.door",
        "with its wire cut, the door reads open",
    ),
    (
        "door_opened",
        {"inputs": inputs(door_opened=alarm(2))},
        "inputs.door_opened",
        "with its wire cut, the door reads open",
    ),
    (
        "rear_door_opened",
        {
            "floors": TWO_FLOORS,
            "inputs": inputs(**{**REAR, "rear_door_opened": alarm(50)}),
            "outputs": {"rear_door_open": coil(5)},
        },
        "inputs.rear_door_opened",
        "with its wire cut, the rear_door reads open",
    ),
    (
        "floor_bit0",
        binary(codes={0: "B1", 1: "G", 2: "1"}, between_floors=[]),
        "floor_code",
        "with the floor code's cable cut, the daemon reads the car at B1",
    ),
    (
        "door_open",
        {"outputs": {"door_open": pin("J8:36", "low")}},
        "outputs.door_open",
        "BCM16 = J8:36 is pulled low from power-on through boot, and low switches its relay on:"
        " use BCM4 to 8, or the opposite active level",
    ),
    (
        "call_G",
        {"calls": {"B1": coil(2), "G": pin("BCM5", "high"), "1": coil(4)}},
        "calls.G",
        "BCM5 = J8:29 is pulled high from power-on through boot, and high switches its relay on:"
        " use BCM9 to 27, or the opposite active level",
    ),
]


@pytest.mark.parametrize(("signal", "changes", "path", "text"), UNSAFE)
def test_unsafe_wiring_is_refused_unless_it_is_accepted_by_name(
    signal: str, changes: dict[str, Any], path: str, text: str
) -> None:
    advice = f"unsafe: {text}; or accept_unsafe: {{{signal}: <why it is safe here>}}"
    assert found(settings(**changes)) == [(path, advice)]
    assert found(settings(**changes, accept_unsafe={signal: "tested on site"})) == []


def test_a_safe_choice_of_pins_is_not_refused() -> None:
    outputs = {"door_open": pin("BCM16", "high"), "agv_mode_request": pin("BCM5", "low")}
    assert found(settings(outputs=outputs)) == []
    closed = one_door("closed", **pin("BCM4", "low", pull="down"))
    assert found(settings(inputs=closed)) == []


def test_the_first_public_wiring_is_possible_when_its_two_unsafe_places_are_accepted() -> None:
    """This wiring has three unsafe places:
    - If the wire of the door's contact is cut, the door reads open.
    - If the cable of the floor code is cut, the car reads at L1.
    - The relay of `door_open` is on at a low level, and its pin is low from power-on through boot."""
    literal = {
        "floors": ["L1", "L2", "L3", "L4"],
        "inputs": {
            "fire_alarm": pin("J8:7", "low", pull="down"),
            "code_blue": pin("J8:11", "low", pull="down"),
            "agv_mode": pin("J8:13", "high", pull="down"),
            "door": pin("J8:35", "high", pull="down", proves="closed"),
        },
        "floor_code": {
            "encoding": "binary",
            "bits": [pin(f"J8:{at}", "high", pull="down") for at in (29, 31, 32, 33)],
            "codes": {0: "L1", 1: "L2", 2: "L3", 3: "L4"},
            "between_floors": [],
        },
        "outputs": {
            "agv_mode_request": pin("J8:12", "high"),
            "door_open": pin("J8:36", "low"),
        },
        "calls": {f"L{i + 1}": pin(f"J8:{at}", "high") for i, at in enumerate((15, 16, 18, 22))},
    }
    reason = "as the lift maker wired it; the door's own safety edge is independent"
    accepted = dict.fromkeys(("door", "door_open", "floor_bit0"), reason)
    assert [path for path, _ in found(settings(**literal))] == [
        "inputs.door",
        "floor_code",
        "outputs.door_open",
    ]
    assert found(settings(**literal, accept_unsafe=accepted)) == []


def test_accepting_wiring_that_does_not_exist_is_pointed_out() -> None:
    wired = settings(accept_unsafe={"door_closed": "why"})
    assert warned(wired) == [
        ("accept_unsafe.door_closed", "nothing is unsafe about door_closed: delete this entry")
    ]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {"inputs": inputs(agv_mode=None, fire_alarm=None)},
            [
                ("inputs", "no agv_mode: the lift cannot confirm that it serves the robot"),
                ("inputs", "no fire_alarm: a fire recall would not be seen"),
            ],
        ),
        (
            {"inputs": inputs(code_blue=line(40), earthquake=alarm(41), emergency=floating(4))},
            [
                ("inputs.code_blue", "with its wire cut, code_blue reads clear"),
                ("inputs.emergency", "a cut wire floats (pull: none), and emergency reads clear"),
            ],
        ),
        ({"inputs": inputs(code_blue=alarm(40), overload=line(41), manual_mode=line(42))}, []),
        (
            {"inputs": inputs(moving=line(40))},
            [("inputs.moving", "with its wire cut, the car reads as standing")],
        ),
        ({"inputs": inputs(moving=alarm(40))}, []),
        ({"inputs": inputs(stopped=line(40))}, []),
        (
            binary(codes={1: "B1", 3: "G", 4: "1"}),
            [
                (
                    "floor_code",
                    "with floor_bit1 cut, G reads as B1; with floor_bit1 shorted, B1 reads as G: ask"
                    " for a parity line, or for codes that differ in at least two lines",
                )
            ],
        ),
        (
            calls_by({1: "B1", 2: "G", 3: "1"}),
            [
                (
                    "call_code",
                    "each bit is switched by a request of its own, so a call to 1 (3) may show 1,"
                    " which calls B1, for a moment: if the controller also takes calls from a register,"
                    " use driver: register with call",
                )
            ],
        ),
        (calls_by({1: "B1", 2: "G", 4: "1"}), []),
        (calls_by({1: "B1", 2: "G", 3: "1"}, "BCM"), []),
        (binary(codes={1: "B1", 3: "G", 4: "1"}, parity=line(41, total="even")), []),
        (binary(codes={3: "B1", 5: "G", 6: "1"}), []),
        (
            binary(bits=[alarm(20), *bits(2, 21)], codes={2: "B1", 3: "G", 4: "1"}),
            [
                (
                    "floor_code",
                    "with floor_bit0 cut, B1 reads as G; with floor_bit0 shorted, G reads as B1: ask"
                    " for a parity line, or for codes that differ in at least two lines",
                )
            ],
        ),
    ],
)
def test_wiring_that_works_but_is_unlikely_is_warned_of(
    changes: dict[str, Any], expected: list[tuple[str, str]]
) -> None:
    assert warned(settings(**changes)) == expected


def test_every_hazard_has_a_line_of_its_name() -> None:
    names = {h.value for h in Hazard}
    assert names <= set(settings().inputs.__struct_fields__)


def test_unsafe_wiring_is_reported_with_all_other_problems_and_not_after_them() -> None:
    wired = settings(floors=["B1", "G", "1", "G"], inputs=inputs(fire_alarm=line(40)))
    assert found(wired) == [
        ("floors", "a floor is named twice: delete one"),
        (
            "inputs.fire_alarm",
            "unsafe: with its wire cut, a fire alarm reads clear; or accept_unsafe: {fire_alarm:"
            " <why it is safe here>}",
        ),
    ]


def test_agv_mode_that_no_output_asks_for_is_warned_of() -> None:
    assert warned(settings(outputs={"door_open": coil(1)})) == [
        (
            "outputs",
            "no agv_mode_request, although the daemon waits for AGV mode: the lift must enter AGV"
            " mode by itself",
        )
    ]


BY_CALL = {"agv_mode": "by_call", "outputs": {"door_open": coil(1)}}


def test_agv_mode_by_call_is_shown_by_the_lift_and_asked_for_by_calls_only() -> None:
    assert (found(settings(**BY_CALL)), warned(settings(**BY_CALL))) == ([], [])
    assert found(settings(**BY_CALL, inputs=inputs(agv_mode=None))) == [
        (
            "agv_mode",
            "by_call needs an agv_mode input, which alone shows that the lift has accepted a call",
        )
    ]
    assert found(settings(agv_mode="by_call")) == [
        (
            "outputs.agv_mode_request",
            "with agv_mode: by_call a call already requests AGV mode: delete this or by_call",
        )
    ]
    assert warned(settings(agv_mode="by_call", outputs={})) == [
        (
            "inputs",
            "no door_open: with by_call nothing keeps AGV mode on while a robot enters or leaves",
        )
    ]


def test_a_fire_that_no_topic_announces_is_noted_and_not_warned_of() -> None:
    silent = [
        (
            ("alarm",),
            "a fire stops this lift for robots, but no topic tells the fleets about it (alarm: none)",
        )
    ]
    assert (list(notes(settings())), warned(settings())) == (silent, [])
    assert list(notes(settings(alarm="fire_alarm_trigger"))) == []
    assert list(notes(settings(inputs=inputs(fire_alarm=None)))) == []
    blue = inputs(code_blue={"point": "BCM27", "active": "low", "pull": "down"})
    untold = "code_blue stops this lift for robots, but no topic tells the fleets"
    assert list(notes(settings(alarm="emergency_signal", inputs=blue))) == [(("alarm_on",), untold)]
    both = ["fire_alarm", "code_blue"]
    assert list(notes(settings(alarm="emergency_signal", alarm_on=both, inputs=blue))) == []
    assert [str(note).partition("note: ")[2] for note in load(CONFIG).notes] == [
        f"'Lift1': {silent[0][1]}"
    ]


def test_a_hazard_of_alarm_on_that_is_not_wired_is_warned_of() -> None:
    text = "no code_blue: this lift does not report it, so RMF gets no alarm"
    both = settings(alarm="emergency_signal", alarm_on=["fire_alarm", "code_blue"])
    assert [w for w in warnings(both) if w[0][0] == "alarm_on"] == [(("alarm_on", "1"), text)]


def test_alarm_on_without_a_topic_is_refused() -> None:
    text = "alarm: none sends no alarm; write alarm: emergency_signal"
    found = list(settings(alarm_on=["code_blue"]).problems())
    assert (("alarm_on",), text) in found
