"""Files that our recorder has kept, each for one reason, such as a fault. `explain` explains the state
at the moment of that reason."""

import json
from collections.abc import Iterator
from datetime import UTC

import pytest

from bridges.blackbox.triggers import DIED, FAULT, REFUSED, WAITING
from bridges.messages import definitions as d
from bridges.messages.heard import Heard, Own
from bridges.messages.stamps import stamp
from bridges.messages.words import Kind
from bridges.runtime.faults import for_explain
from workbench.explain.explanation import Explanation
from workbench.explain.heard_devices import HeardDevices

WALL, LAST_S, KEPT_S = 1_800_000_000.0, 40.0, 20.0
NAME = "bay7"
"""The name of the device in every file of these tests."""
REFUSALS = ("floor not served", "held by another session", "charger occupied", "malformed")


def state(kind: Kind, at: float) -> Heard:
    """Return the state of an idle device."""
    made: dict[Kind, tuple[str, d.Message]] = {
        "lift": (
            "lift_states",
            d.LiftState(stamp(WALL + at), NAME, ("L1", "L2"), "L1", current_mode=2),
        ),
        "door": ("door_states", d.DoorState(stamp(WALL + at), NAME)),
        "charger": ("charger_states", d.ChargerState(stamp(WALL + at), 1, NAME)),
    }
    return Heard(at, WALL + at, *made[kind])


def own(at: float, topic: str, /, **told: object) -> Own:
    return Own(at, WALL + at, f"rmf_bridge/{topic}", json.dumps(told))


def recorded(kind: Kind, code: str, text: str) -> Iterator[Heard | Own]:
    """Yield the content of an idle device's file. In the middle is the event for which the recorder
    kept the file. A fault ends 5 s after this event."""
    fault = {"code": text.partition(": ")[0], "detail": text.partition(": ")[2]}
    for second in range(int(LAST_S)):
        if second == KEPT_S:
            subject = "" if code == DIED else NAME
            yield own(second, "notes", at=second, code=code, text=text, subject=subject)
            yield own(second, "faults", subject=NAME, faults=[fault] * (code == FAULT))
        if code == DIED and second > KEPT_S:
            return
        if second == KEPT_S + 5:
            yield own(second, "faults", subject=NAME, faults=[])
        yield state(kind, float(second))


def explained(kind: Kind, code: str, text: str) -> Explanation:
    site = HeardDevices(NAME)
    for one in recorded(kind, code, text):
        site.take(one)
    return site.explain(kind, NAME, UTC, for_explain())


@pytest.mark.parametrize("kind", ["lift", "door", "charger"])
@pytest.mark.parametrize("code", sorted(for_explain()))
def test_every_fault_for_which_a_file_is_kept_is_named_and_somebody_has_to_act(
    kind: Kind, code: str
) -> None:
    found = explained(kind, FAULT, f"{code}: the detail")
    assert found.now[0].startswith(f"This file was kept for the fault {code}: the detail.")
    remedy = for_explain()[code][1]
    if found.next[0].who == "nobody":
        assert found.next[0].what == remedy
        assert remedy.startswith(("nothing", "wait", "intended"))
    assert [fault.code for fault in found.faults] == [code]


@pytest.mark.parametrize("kind", ["lift", "door", "charger"])
@pytest.mark.parametrize("refusal", REFUSALS)
def test_a_refusal_for_which_a_file_is_kept_is_somebodys_to_compare(
    kind: Kind, refusal: str
) -> None:
    found = explained(kind, REFUSED, f"{refusal}: the detail")
    assert found.now[0].startswith(
        f"This file was kept because a request was refused: {refusal}: the detail."
    )
    assert (found.next[0].who, "refus" in found.next[0].what) == ("a person", True)


@pytest.mark.parametrize("kind", ["lift", "door", "charger"])
def test_a_dead_daemons_file_is_about_its_death(kind: Kind) -> None:
    found = explained(kind, DIED, "killed")
    assert found.now[:2] == (
        "This file was kept because the daemon died: killed. The next sentences are about 08:00:20.",
        "The daemon that wrote this file died then. The file ends at its death, so what came after is"
        " unknown.",
    )
    assert (found.next[0].who, "rmf-bridge status" in found.next[0].what) == ("a person", True)


@pytest.mark.parametrize(
    ("code", "text", "why"),
    [
        (WAITING, "fleet/red has waited for L2 for 180 s", "because fleet/red has waited for L2"),
        ("OPERATOR", "it jerked", 'by a person, who wrote "it jerked".'),
        ("OPERATOR", "", "by a person."),
        ("LATER", "of a later version", 'by a person, who wrote "of a later version".'),
    ],
)
def test_a_wait_and_a_persons_note_are_told_first(code: str, text: str, why: str) -> None:
    assert explained("lift", code, text).now[0].startswith(f"This file was kept {why}")


def test_a_robot_that_did_not_come_is_looked_for_though_the_charger_is_idle_again() -> None:
    found = explained("charger", FAULT, "START_TIMEOUT: fleet/red did not start in time")
    assert found.next[0].who == "a person"
    assert found.next[0].what.startswith("find the robot")


def test_what_came_after_the_moment_is_one_line() -> None:
    found = explained("lift", FAULT, "FIRE")
    assert [text for text in found.now if "end of the file" in text] == [
        "At the end of the file, at 08:00:39: car at L1, door closed, mode AGV; held by nobody."
    ]


def test_an_end_that_is_asked_for_is_explained_instead_of_the_moment() -> None:
    site = HeardDevices(NAME)
    for one in recorded("lift", FAULT, "FIRE"):
        site.take(one)
    site.at_its_end()
    found = site.explain("lift", NAME, UTC, for_explain())
    assert (found.now[-1], found.next[0].who) == ("Nobody requests the lift.", "nobody")
