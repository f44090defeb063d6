"""When the core sends, completes, repeats and stops a robot's commands (FLEET-1 to FLEET-4)."""

from typing import Any

import pytest

from bridges.kinds.fleet.signals import Act, Navigate, Stop
from bridges.kinds.shared.decision import Fault, OperatorReset, WriteFailed
from tests.kinds.fleet.story import PANTRY, SCAN_S, Story, at, driving, goal


def test_a_robot_that_reports_completed_commands_is_done_at_its_goal() -> None:  # FLEET-2
    story = driving(7, completed="", moving=True)
    story.see(3.0, at=at(2.0)).see(at=at(4.6))
    assert (story.report.activity, story.report.finished, story.report.light) == (7, 0, None)
    story.see(at=at(4.9), completed="7", moving=False)
    assert story.commands == [(0.0, "navigate 7, attempt 1"), (3.0, "none")]
    assert (story.report.activity, story.report.finished, story.report.at) == (0, 7, at(4.9))


def test_a_robot_that_reports_no_commands_is_done_when_it_stands_at_its_goal() -> None:  # FLEET-2
    story = driving(7)
    story.see(at=at(4.6)).see(0.9)
    assert story.report.finished == 0
    story.see(0.2)
    assert story.report.finished == 7
    assert not story.faults


def test_a_robot_at_its_goal_must_also_face_in_the_right_direction() -> None:
    story = driving(7)
    story.see(2.0, at=at(5.0, yaw=1.0))
    assert story.report.finished == 0
    story.see(2.0, at=at(5.0, yaw=0.3))
    assert story.report.finished == 7


def test_a_robot_that_lies_about_its_arrival_is_not_believed() -> None:  # FLEET-2
    story = driving(7, completed="", moving=False)
    story.see(1.0, completed="7")
    assert story.report.finished == 0
    assert story.report.faults == (
        Fault("ROBOT_NOT_THERE", "it reports arrival, but is 5 m from its goal"),
    )
    story.see(at=at(5.0))
    assert story.report.finished == 7


def test_the_completed_number_of_an_earlier_command_completes_no_later_command() -> None:
    story = driving(7, completed="6", moving=False, to=goal(0.2))
    story.see(5.0)
    assert story.report.finished == 0


def test_a_goal_on_another_map_is_never_reached_by_its_numbers() -> None:
    story = driving(7, to=goal(0.0, level="L2"), completed="7", moving=False)
    story.see(1.0)
    assert story.report.finished == 0
    assert story.faults == ["ROBOT_NOT_THERE"]


def test_a_command_to_a_standing_robot_is_repeated_ever_more_rarely() -> None:  # FLEET-3
    story = driving(7, moving=False).see(100.0)
    assert story.commands == [
        (0.0, "navigate 7, attempt 1"),
        (10.0, "navigate 7, attempt 2"),
        (30.0, "navigate 7, attempt 3"),
        (60.0, "navigate 7, attempt 4"),
        (100.0, "navigate 7, attempt 5"),
    ]
    assert story.faults == ["ROBOT_NOT_OBEYING"]
    assert not story.report.fit


def test_no_command_is_repeated_to_a_driving_robot() -> None:  # FLEET-3
    story = driving(7, moving=True).see(60.0)
    assert story.commands == [(0.0, "navigate 7, attempt 1")]


def test_a_goal_that_was_refused_is_sent_again_while_the_robot_drives_to_the_earlier_one() -> None:
    """FLEET-3."""
    story = driving(7, moving=True).see(1.0).order(Navigate(8, goal(8.0)))
    story.see(10.0, refused="navigate is refused: busy")
    assert story.commands[-1] == (11.0, "navigate 8, attempt 2")
    story.see(60.0, refused="", moving=True)
    assert story.commands[-1] == (11.0, "navigate 8, attempt 2")


def test_a_warning_about_a_command_that_the_robot_carries_out_repeats_nothing() -> None:
    """A robot on VDA 5050 reports an error that refers to its order, and drives on."""
    story = driving(7, moving=True).see(60.0, refused="blocked", taken=(7, 1))
    assert story.commands == [(0.0, "navigate 7, attempt 1")]


def test_the_pause_begins_when_the_robot_comes_to_stand() -> None:
    story = driving(7)
    for x in range(1, 10):
        story.now += 1.0
        story.see(at=at(x / 10))
    story.see(9.0)
    assert len(story.commands) == 1
    story.see(1.1)
    assert story.commands[1:] == [(19.0, "navigate 7, attempt 2")]


def test_an_operators_reset_begins_the_attempts_anew() -> None:  # FLEET-12
    story = driving(7, moving=False).see(100.0)
    assert not story.report.fit
    story.take(OperatorReset())
    assert story.commands[-1] == (100.0, "navigate 7, attempt 6")
    assert story.report.fit


def test_a_reset_without_a_command_changes_nothing() -> None:
    story = Story().see()
    before = story.memory
    assert story.take(OperatorReset()).memory == before


def test_an_action_is_done_when_the_robot_says_so_and_is_never_sent_twice() -> None:  # FLEET-3
    story = Story().see(completed="", moving=False).order(Act(9, "clean", '{"zone": "lounge"}'))
    story.see(300.0)
    assert story.commands == [(0.0, "act 9, attempt 1")]
    story.see(completed="9")
    assert story.report.finished == 9


def test_a_refused_action_is_sent_again() -> None:  # FLEET-3
    story = Story().see(completed="", moving=False).order(Act(9, "clean"))
    story.see(10.0, refused="act is refused: no such zone")
    assert story.commands[-1] == (10.0, "act 9, attempt 2")
    assert story.report.faults == (Fault("ROBOT_REFUSES", "act is refused: no such zone"),)


def test_an_action_without_an_answer_waits_for_a_person() -> None:
    story = Story().see(completed="", moving=False).order(Act(9, "clean"))
    story.see(60.0, unanswered=True)
    assert story.faults == ["ROBOT_ACTION_UNANSWERED"]
    story.take(OperatorReset())
    assert story.commands[-1] == (60.0, "act 9, attempt 2")


def test_an_action_that_failed_waits_for_a_person() -> None:  # FLEET-3, FLEET-12
    story = Story().see(completed="", moving=False).order(Act(9, "clean"))
    story.see(300.0, failed="the action clean has failed")
    assert story.commands == [(0.0, "act 9, attempt 1")]
    text = "the action clean has failed: a reset sends it again"
    assert story.report.faults == (Fault("ROBOT_ACTION_FAILED", text),)
    story.take(OperatorReset())
    assert story.commands[-1] == (300.0, "act 9, attempt 2")


def test_a_new_order_replaces_the_old_one() -> None:  # FLEET-1
    story = driving(7, completed="", moving=True).see(1.0, at=at(1.0))
    story.order(Navigate(8, goal(8.0)))
    story.see(1.0, completed="7", at=at(5.0))
    assert story.commands == [(0.0, "navigate 7, attempt 1"), (1.0, "navigate 8, attempt 1")]
    assert story.report.finished == 0


def test_a_stop_ends_when_the_robot_stands() -> None:  # FLEET-4
    story = driving(7, moving=True).see(1.0).order(Stop(8, of=7))
    assert story.report.activity == 0
    story.see(2.0)
    assert story.memory.command is not None
    story.see(moving=False)
    assert story.commands == [
        (0.0, "navigate 7, attempt 1"),
        (1.0, "stop 8, attempt 1"),
        (3.0, "none"),
    ]


def test_a_robot_that_drives_on_is_stopped_again() -> None:  # FLEET-4
    story = driving(7, moving=True).order(Stop(8, of=7)).see(6.5)
    assert story.commands[1:] == [
        (0.0, "stop 8, attempt 1"),
        (3.0, "stop 8, attempt 2"),
        (6.0, "stop 8, attempt 3"),
    ]
    assert story.faults == ["ROBOT_NOT_STOPPING"]
    story.see(4.0)
    assert story.faults == ["ROBOT_NOT_STOPPING", "ROBOT_NOT_OBEYING"]


def test_a_robot_that_has_not_moved_off_yet_is_stopped_too() -> None:  # FLEET-4, FLEET-11
    """It stood before the stop, but the command that is stopped may already be on its way."""
    story = driving(7, moving=False).see(0.5).order(Stop(8, of=7))
    assert story.commands[-1] == (0.5, "stop 8, attempt 1")
    story.now += SCAN_S
    assert story.see().commands[-1] == (0.625, "none")


def test_a_stop_that_was_not_taken_is_sent_again_although_the_robot_stands() -> None:  # FLEET-4
    """It waits behind a person, and drives off when the person has gone."""
    story = driving(7, moving=False).order(Stop(8, of=7))
    story.takes = False
    story.see(30.0)
    assert [words for _, words in story.commands[1:4]] == [
        "stop 8, attempt 1",
        "stop 8, attempt 2",
        "stop 8, attempt 3",
    ]
    text = "it stands, but has not taken the stop"
    assert story.report.faults == (Fault("ROBOT_NOT_STOPPING", text),)
    assert story.report.fit, "RMF's next order replaces the stop"
    story.see(1.0, moving=True)
    assert story.faults == ["ROBOT_NOT_STOPPING", "ROBOT_NOT_OBEYING"]
    story.see(taken=(8, 3), moving=False)
    assert story.memory.command is not None, "the robot may have driven since that stop"
    story.takes = True
    assert story.see(3.0).commands[-1][1] == "none"


def test_a_stop_is_sent_again_to_a_robot_that_is_not_read() -> None:  # FLEET-4
    story = driving(7, moving=True).order(Stop(8, of=7)).see().silence(7.0)
    assert story.commands[-1] == (6.0, "stop 8, attempt 3")


@pytest.mark.parametrize(
    "kept",
    [{"paused": True}, {"taken_out": "manual mode"}, {"fault": "emergency stop"}],
    ids=lambda kept: str(next(iter(kept))),
)
def test_a_robot_that_a_person_keeps_standing_is_not_sent_off_again(kept: dict[str, Any]) -> None:
    """FLEET-3."""
    story = driving(7, moving=False).see(100.0, **kept)
    assert story.commands == [(0.0, "navigate 7, attempt 1")]
    story.see(1.0, paused=False, taken_out="", fault="")
    assert story.commands[-1] == (100.0, "navigate 7, attempt 2")


@pytest.mark.parametrize(
    "kept",
    [{"paused": True}, {"taken_out": "manual mode"}, {"fault": "emergency stop"}],
    ids=lambda kept: str(next(iter(kept))),
)
def test_a_reset_sends_no_robot_off_that_a_person_keeps_standing(kept: dict[str, Any]) -> None:
    """FLEET-12."""
    story = driving(7, moving=False).see(100.0, **kept).take(OperatorReset())
    assert story.commands == [(0.0, "navigate 7, attempt 1")]
    story.see(1.0, paused=False, taken_out="", fault="")
    assert story.commands[-1] == (100.0, "navigate 7, attempt 2")


def test_a_robot_that_is_paused_says_so_with_any_control() -> None:
    story = driving(7, moving=False).see(paused=True)
    text = "it is paused, and RMF resumes no robot"
    assert story.report.faults == (Fault("ROBOT_PAUSED_BY_OTHERS", text),)


def test_a_command_that_cannot_be_sent_is_a_fault_and_rmf_still_gets_the_place() -> None:
    """FLEET-13."""
    story = driving(7, moving=True)
    story.takes = False
    story.take(WriteFailed("timeout")).see(at=at(1.0))
    assert story.report.at == at(1.0)
    assert story.report.faults == (Fault("ROBOT_NOT_COMMANDED", "timeout"),)
    story.takes = True
    assert story.see().faults == []
    story.take(WriteFailed("timeout")).see(refused="busy", taken=(0, 0))
    assert story.faults == ["ROBOT_REFUSES"]


def test_a_reset_for_another_robot_repeats_no_action() -> None:  # FLEET-12
    story = Story().see(completed="").order(Act(9, "clean")).see(20.0).take(OperatorReset())
    assert story.commands == [(0.0, "act 9, attempt 1")]


def test_a_reset_begins_the_attempts_of_an_action_anew() -> None:  # FLEET-12
    story = Story().see(completed="").order(Act(9, "clean")).see(60.0, refused="act is refused")
    sent = story.see(refused="").commands
    assert not story.report.fit
    story.take(OperatorReset())
    assert (story.report.fit, story.memory.tries, story.commands) == (True, 1, sent)


def test_a_stop_without_a_word_about_motion_is_believed_after_a_second_of_standing() -> None:
    story = driving(7)
    for x in range(1, 11):
        story.now += SCAN_S
        story.see(at=at(x / 10))
    story.order(Stop(8, of=7)).see(0.9)
    assert story.memory.command is not None
    story.see(0.2)
    assert story.memory.command is None


def test_a_stop_of_an_earlier_command_stops_nothing() -> None:
    story = driving(7, moving=True).order(Navigate(8, PANTRY)).order(Stop(9, of=7))
    assert story.commands[-1] == (0.0, "navigate 8, attempt 1")


def test_a_robot_that_keeps_an_earlier_order_gets_the_new_command_again() -> None:  # FLEET-4
    """The driver cancels the earlier order at each attempt. A message of VDA 5050 can get lost."""
    story = driving(7, moving=True).order(Navigate(8, goal(8.0))).see(2.875, busy=True)
    assert (len(story.commands), story.faults) == (2, [])
    story.see(0.125)
    assert story.commands[-1] == (3.0, "navigate 8, attempt 2")
    text = "it keeps an earlier order, although that was cancelled"
    assert story.report.faults == (Fault("ROBOT_NOT_STOPPING", text),)
    story.see(3.0, moving=False, fault="emergency stop")
    assert story.commands[-1] == (6.0, "navigate 8, attempt 3")
    story.see(100.0, busy=False, moving=True, fault="")
    assert (story.commands[-1], story.faults) == ((6.0, "navigate 8, attempt 3"), [])


def test_an_action_that_waits_for_an_earlier_order_is_no_action_that_was_sent() -> None:
    story = driving(7, completed="", moving=True).order(Act(8, "clean")).see(3.0, busy=True)
    assert story.commands[-1] == (3.0, "act 8, attempt 2")
    story.see(60.0, busy=False)
    assert story.commands[-1] == (3.0, "act 8, attempt 2")


def test_a_new_goal_replaces_a_stop() -> None:  # FLEET-4
    story = driving(7, moving=True).order(Stop(8, of=7)).order(Navigate(9, PANTRY))
    story.see(20.0)
    assert story.commands[-1] == (0.0, "navigate 9, attempt 1")


def test_a_command_that_rmf_has_given_up_is_stopped() -> None:  # FLEET-11
    story = Story().see(completed="", moving=True).order(Act(9, "clean")).order(Stop(10, of=9))
    assert story.commands[-1] == (0.0, "stop 10, attempt 1")
