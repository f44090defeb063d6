"""The questions of `rmf-bridge init`: each with its condition, its default answer and its choices."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, get_args

from workbench.commissioning.init import ADDRESSES, WIRINGS, gateway
from workbench.commissioning.init.answers import LIFT_INPUTS, OFFERED, Encoding, Kind, Level

Given = dict[str, Any]
"""Answers that are already known. The keys are names of DraftAnswers' fields."""


@dataclass(frozen=True, slots=True)
class Question:
    """A question: its name in DraftAnswers, its text and its condition.

    `offered` is the default answer; "" if nobody may guess the answer. `choices` lists the possible
    answers; with (), any text is possible.
    """

    name: str
    text: str
    offered: Callable[[Given], Any]
    choices: Callable[[Given], tuple[str, ...]] = lambda given: ()
    needed: Callable[[Given], bool] = lambda given: True
    several: bool = False


def _is_lift(given: Given) -> bool:
    return bool(given["kind"] == "lift")


def _is_fleet(given: Given) -> bool:
    return bool(given["kind"] == "fleet")


def _is_lift_on_contacts(given: Given) -> bool:
    return _is_lift(given) and given["wiring"] not in ("gateway", "http")


def _in_table(name: str, given: Given) -> bool:
    """Return whether the draft needs this part of the register table."""
    if given["wiring"] != "gateway":
        return False
    if name == "motion_numbers":
        return bool(given.get("motion_at", gateway.ABSENT) != gateway.ABSENT)
    return _is_lift(given) or name in (*gateway.DOOR_PLACES, "door_numbers")


def _offered(name: str, given: Given) -> str:
    if name in gateway.PLACES:
        return gateway.PLACES[name][1]
    if name == gateway.NO_CALL:
        return gateway.offered_no_call(given["floor_numbers"])
    if name != "floor_numbers":
        return "0,1,2"
    floors = [floor for floor in given["floors"].split(",") if floor.strip()]
    return ",".join(str(i) for i, _ in enumerate(floors, start=1))


def _places() -> tuple[Question, ...]:
    """Return the questions about a gateway's register table."""
    return tuple(
        Question(name, text, partial(_offered, name), needed=partial(_in_table, name))
        for name, text in gateway.questions().items()
    )


def _on_the_header(given: Given) -> bool:
    return bool(given["wiring"] == "gpio")


QUESTIONS: Final = (
    Question("kind", "What is it?", lambda given: "lift", lambda given: get_args(Kind)),
    Question(
        "name",
        "The device's name on RMF's map?",
        lambda given: "AMR01" if _is_fleet(given) else f"{given['kind'].capitalize()}1",
    ),
    Question(
        "wiring",
        "How is it wired?",
        lambda given: WIRINGS[given["kind"]][0],
        lambda given: WIRINGS[given["kind"]],
    ),
    Question(
        "address",
        "The host, serial port or CAN interface?",
        lambda given: ADDRESSES[given["wiring"]],
        needed=lambda given: given["wiring"] in ADDRESSES,
    ),
    Question(
        "unit",
        "The module's unit id?",
        lambda given: "1",
        needed=lambda given: given["wiring"] in ("modbus", "rs485", "gateway"),
    ),
    Question(
        "floors",
        "The lift's floors, from the lowest up?",
        lambda given: "L1,L2,L3",
        needed=_is_lift,
        several=True,
    ),
    Question(
        "signals",
        "Which inputs are wired?",
        lambda given: ",".join(OFFERED),
        lambda given: LIFT_INPUTS,
        needed=_is_lift_on_contacts,
        several=True,
    ),
    Question(
        "encoding",
        "How do the lines show the floor?",
        lambda given: "binary",
        lambda given: get_args(Encoding),
        needed=_is_lift_on_contacts,
    ),
    Question(
        "contacts",
        "Level of a closed contact (high: to 3.3 V, low: to ground)?",
        lambda given: "high",
        lambda given: get_args(Level),
        needed=_on_the_header,
    ),
    Question(
        "relays",
        "Level that switches a relay on?",
        lambda given: "high",
        lambda given: get_args(Level),
        needed=_on_the_header,
    ),
    Question(
        "fleet_config",
        "RMF's config.yaml of the fleet?",
        lambda given: "config.yaml",
        needed=_is_fleet,
    ),
    Question("graph", "The fleet's nav graph?", lambda given: "nav_graph.yaml", needed=_is_fleet),
    *_places(),
    Question("domain_id", "RMF's ROS_DOMAIN_ID?", lambda given: "0"),
)
