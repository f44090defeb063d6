"""The commands of the page's buttons. The parser of the command line accepts each command."""

import pytest

from bridges.cli import whole_parser
from bridges.messages import definitions as d
from workbench.graph.board import BoardRow
from workbench.page.actions import AGAIN, Action, Local, PastAction, actions, fail, press, queue
from workbench.page.live_site import DeviceView

GRAPH = ("--domain-id", "7", "--localhost")
HOSTILE = "--config=/etc/shadow"
LOCAL = Local("/etc/rmf-bridges/a.yaml", ("a", "b"), False, ("robot",), ("unit",), "/run/a")


def parsed(action: Action) -> dict[str, object]:
    return vars(whole_parser().parse_args([*action.words]))


@pytest.mark.parametrize("name", ["Lift1", HOSTILE, "-h", "a b"])
def test_a_held_lift_can_be_released_whatever_it_and_its_holder_are_called(name: str) -> None:
    state = d.LiftState(lift_name=name, session_id=name)
    (action,) = actions(DeviceView(BoardRow("lift", name, ""), state), None, GRAPH)
    found = parsed(action)
    assert (found["command"], found["name"], found["session"]) == ("release", name, name)
    assert (found["domain_id"], found["config"], found["localhost"]) == (7, None, True)


def test_a_free_lift_and_a_door_offer_no_action_on_the_graph() -> None:
    assert actions(DeviceView(BoardRow("lift", "a", ""), d.LiftState()), None, GRAPH) == []
    assert actions(DeviceView(BoardRow("door", "a", ""), d.DoorState()), None, GRAPH) == []


@pytest.mark.parametrize("name", ["pad", HOSTILE])
def test_a_charge_can_be_cancelled_and_queued(name: str) -> None:
    state = d.ChargerState(charger_name=name, request_id=name)
    (action,) = actions(DeviceView(BoardRow("charger", name, ""), state), None, GRAPH)
    found = parsed(action)
    assert (found["command"], found["name"], found["cancel"]) == ("send", name, name)
    found = parsed(queue(name, HOSTILE, GRAPH))
    assert (found["name"], found["robot"], found["queue"]) == (name, HOSTILE, True)


def test_before_and_after_a_cancel_the_coordinators_next_request_is_foretold() -> None:
    told = []
    for request in ("send-1", "charger_coordinator/tiny/R1/1"):
        state = d.ChargerState(charger_name="pad", request_id=request)
        (action,) = actions(DeviceView(BoardRow("charger", "pad", ""), state), None, GRAPH)
        said = "1 s  done     pad  pad no longer serves request x"
        past = PastAction(0.0, "ann", action.text, 0, said, action.done)
        told.append([AGAIN in action.question, AGAIN in past.came])
    assert told == [[False, False], [True, True]]


def test_a_daemon_on_this_machine_can_be_reset_and_its_simulation_pressed_and_failed() -> None:
    (reset,) = actions(DeviceView(BoardRow("door", "a", ""), d.DoorState()), LOCAL, GRAPH)
    assert str(parsed(reset)["file"]) == LOCAL.file
    every = "Clear each latched fault whose cause is gone, on every device of the daemon: a, b?"
    assert reset.question == every
    pressed = parsed(press(LOCAL, HOSTILE, "robot", on=False))
    assert (pressed["device"], pressed["signal"], pressed["how"]) == (HOSTILE, "robot", "off")
    failed = parsed(fail(LOCAL, HOSTILE, "unit", "stuck"))
    assert (failed["device"], failed["part"]) == (HOSTILE, "unit")


def test_a_reset_asks_about_all_devices_of_the_daemon_and_about_robots_that_will_drive() -> None:
    local = Local("/etc/a.yaml", tuple(f"door{n}" for n in range(12)), alarms=True)
    (reset,) = actions(DeviceView(BoardRow("door", "a", ""), d.DoorState()), local, GRAPH)
    assert reset.question.endswith(
        ", door8, door9 and 2 more? This also ends the daemon's alarm for the fleets, if its causes"
        " are gone. Then robots that only this alarm stops drive on."
    )
