"""A robot that RMF can only pause: its path, its pauses, and when it may be resumed (`light.py`).

The robot drives from x = 0 over checkpoints at x = 3 m and x = 6 m to x = 9 m. After a pause it still
drives up to 1 m.
"""

from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.fleet.keep import KEEPING
from bridges.kinds.fleet.light import LightQuestion
from bridges.kinds.fleet.messages import summary
from bridges.kinds.fleet.signals import LightAnswer, Pose, RobotSample, Says
from bridges.kinds.shared.decision import Fault, OperatorReset
from tests.kinds.fleet.story import LIMITS, SCAN_S, SITE, Story, at

LIGHT = replace(LIMITS, light=True)
PATH = (at(3.0), at(6.0), at(9.0))
FIRST = {"path": PATH, "moving": False, "paused": False}


def standing(**sample: Any) -> Story:
    """Return a story of a robot that stands at x = 0, and has just been sent on the path."""
    story = Story(LIGHT, RobotSample(at(0.0), 0.8, moving=False, paused=False, path=()))
    return story.see().see(**{**FIRST, **sample})


def says(story: Story, answer: Says, checkpoint: int, path: int = 1) -> Story:
    return story.take(LightAnswer(path, checkpoint, answer))


def started() -> Story:
    """Return the story of a robot that has been paused and resumed at its first checkpoint."""
    story = standing().see(paused=True)
    says(story, "resume", 0).see(paused=False, moving=True)
    return story


def asked(story: Story) -> tuple[int, int, str]:
    """Return the number of the path, the last reached checkpoint, and whether the robot moves or stands
    there."""
    light = story.report.light
    assert light
    return light.number, light.checkpoint, light.stands


def near(one: Pose, x: float) -> bool:
    return abs(one.x - x) < 1e-6 and abs(one.y) < 1e-6


# ---- the path (FLEET-LIGHT-1)


def test_rmf_gets_the_path_on_its_own_map_from_the_robots_place_on() -> None:  # FLEET-LIGHT-1
    light = standing().report.light
    assert isinstance(light, LightQuestion)
    assert [near(place, x) for place, x in zip(light.path, (0, 3, 6, 9), strict=True)] == [True] * 4
    assert (light.number, light.checkpoint, light.stands, light.held) == (1, 0, "at", True)


@pytest.mark.parametrize("told", [PATH, PATH[1:]])
def test_the_rest_of_a_path_is_no_new_path(told: tuple[Pose, ...]) -> None:  # FLEET-LIGHT-1
    story = started()
    says(story, "continue", 0)
    story.see(at=at(3.6), path=told)
    assert asked(story) == (1, 1, "moving")


@pytest.mark.parametrize("told", [(at(3.0), at(3.0, 4.0)), (*PATH, at(9.0, 3.0)), PATH[:2]])
def test_another_path_is_new_and_the_robot_pauses_for_it(
    told: tuple[Pose, ...],
) -> None:  # FLEET-LIGHT-1
    story = started()
    story.see(at=at(1.5), path=told)
    assert asked(story) == (2, 0, "moving")
    assert story.commands[-1][1] == "pause 3, attempt 1"


def test_places_behind_the_robot_and_repeated_ones_are_left_out() -> None:
    story = standing(at=at(4.0), path=(at(0.0), at(3.0), at(6.0), at(6.02), at(9.0)))
    light = story.report.light
    assert light
    assert [near(place, x) for place, x in zip(light.path, (4, 6, 9), strict=True)] == [True] * 3


def test_the_path_is_over_at_its_last_checkpoint() -> None:  # FLEET-LIGHT-1
    story = started()
    for checkpoint, x in enumerate((3.0, 6.0)):
        says(story, "continue", checkpoint).see(at=at(x))
    sent = story.commands
    says(story, "wait", 2).see(at=at(8.0)).see(at=at(9.0), moving=False)
    assert story.report.light == LightQuestion(
        (), 1, 0, "at", SITE.on_rmfs_map(at(9.0)), held=False
    )
    assert (story.commands, story.commands[-1][1]) == (sent, "none")


def test_a_path_over_a_lift_goes_on_at_the_other_floor() -> None:
    story = standing(path=(at(8.0), at(8.0, level="L2"), at(8.0, 5.0, level="L2"))).see(paused=True)
    says(story, "resume", 0).see(paused=False, moving=True, at=at(4.0))
    says(story, "continue", 0).see(at=at(8.0))
    says(story, "continue", 1).see(at=at(8.0, level="L2"))
    assert asked(story) == (1, 2, "moving")


def test_nothing_is_told_of_new_tasks_because_rmf_gives_such_a_robot_none() -> None:
    assert summary(started().report) == {
        "at": "L1 charger_a",
        "doing": "path to L1 lift1_L1, at checkpoint 0 of 3, RMF's light: resume",
        "battery": "80 %",
    }


# ---- when the robot is paused (FLEET-LIGHT-2)


def test_without_an_answer_it_is_paused() -> None:  # FLEET-LIGHT-2
    story = standing(moving=True)
    assert story.commands == [(0.0, "pause 1, attempt 1")]
    story.now += SCAN_S
    story.see(moving=False, paused=True)
    assert story.commands[-1] == (SCAN_S, "none")


def test_it_is_paused_before_the_checkpoint_where_it_must_wait() -> None:  # FLEET-LIGHT-2
    story = started()
    says(story, "wait", 0)
    story.see(at=at(1.9))
    assert story.memory.command is None
    story.see(at=at(2.1))
    assert story.commands[-1][1] == "pause 3, attempt 1"


def test_a_robot_that_may_go_on_is_not_paused_and_asks_ahead() -> None:  # FLEET-LIGHT-3
    story = started()
    says(story, "continue", 0)
    story.see(at=at(1.9))
    assert asked(story) == (1, 0, "moving")
    story.see(at=at(2.1))
    assert asked(story) == (1, 1, "moving"), "it can no longer stop before its next checkpoint"
    assert story.memory.command is None


def test_an_answer_may_be_taken_back() -> None:  # FLEET-LIGHT-2
    story = started()
    says(says(story, "continue", 0), "wait", 0).see(at=at(2.1))
    assert story.commands[-1][1] == "pause 3, attempt 1"


def test_it_is_paused_at_once_if_rmf_says_so() -> None:  # FLEET-LIGHT-2
    story = started()
    says(story, "continue", 0).see(at=at(1.5))
    says(story, "pause", 0)
    assert story.commands[-1][1] == "pause 3, attempt 1"
    story.see(moving=False, paused=True)
    assert asked(story) == (1, 0, "after")
    says(story, "stay", 0).see(60.0)
    assert story.memory.command is None, "it waits for RMF's word"


def test_a_silent_robot_is_paused() -> None:  # FLEET-LIGHT-2
    story = says(started(), "continue", 0).silence(4.9)
    assert story.memory.command is None
    story.silence(0.2)
    assert story.commands[-1][1] == "pause 3, attempt 1"
    assert story.report.light is None


def test_an_answer_about_an_earlier_path_does_not_count() -> None:
    story = started().see(path=(at(0.0, 5.0),), at=at(1.0))
    assert says(story, "continue", 0, path=1).memory.light.answer is None


# ---- a pause counts as obeyed only when the robot stands (FLEET-4)


def test_a_robot_that_does_not_pause_is_told_again_and_the_fault_said() -> None:  # FLEET-4
    story = standing(moving=True).see(3.5, moving=True)
    assert story.commands[-1] == (3.0, "pause 1, attempt 2")
    assert story.report.faults == (Fault("ROBOT_NOT_STOPPING", "it drives on after a pause"),)
    story.see(6.5)
    assert story.faults == ["ROBOT_NOT_STOPPING", "ROBOT_NOT_OBEYING"]
    story.see(moving=False)
    assert story.memory.command is not None, "it stands, and does not report a pause"
    story.see(3.0, moving=False)
    text = "it stands, but has not taken the pause"
    assert story.report.faults == (Fault("ROBOT_NOT_STOPPING", text),)
    story.see(paused=True)
    assert story.memory.command is None


def test_a_robot_that_drives_on_against_a_pause_is_paused_again() -> None:  # FLEET-LIGHT-2
    story = standing().see(SCAN_S, paused=True).see(paused=False, moving=True)
    assert story.commands[-1][1] == "pause 2, attempt 1"


def test_a_robot_beyond_its_light_is_told_and_gets_its_path_anew() -> None:  # FLEET-LIGHT-5
    story = standing(moving=True)
    says(story.see(at=at(1.0)), "error", 0)
    assert story.report.faults == (
        Fault("ROBOT_PASSED_LIGHT", "it is where RMF has not let it go"),
    )
    story.see(at=at(1.6), moving=False, paused=True)
    assert asked(story) == (2, 0, "at")
    assert not story.faults


# ---- a robot that stands right before a checkpoint (FLEET-LIGHT-3)


def test_a_robot_that_stands_before_a_granted_checkpoint_counts_as_there() -> None:
    story = started()
    says(story, "wait", 0).see(at=at(2.4)).see(moving=False, paused=True)
    assert asked(story) == (1, 1, "at")
    says(story, "stay", 1).see(5.0)
    assert story.memory.command is None
    says(story, "resume", 1)
    assert story.commands[-1][1] == "resume 4, attempt 1"


def test_a_checkpoint_that_was_not_granted_is_not_reported() -> None:  # FLEET-LIGHT-3
    story = standing(path=(at(0.8), at(6.0))).see(SCAN_S, paused=True)
    assert asked(story) == (1, 0, "at")
    says(story, "resume", 0).see()
    assert asked(story) == (1, 1, "at")
    assert story.memory.command is None, "it could not stop there: it waits for the next checkpoint"
    says(story, "resume", 1)
    assert story.commands[-1][1] == "resume 2, attempt 1"


# ---- when a paused robot may be resumed (FLEET-LIGHT-4)


def test_a_resume_is_sent_again_until_the_robot_goes_on() -> None:
    story = standing().see(paused=True)
    says(story, "resume", 0).see(10.5)
    assert story.commands[-1] == (10.0, "resume 2, attempt 2")
    story.see(paused=False)
    assert (story.memory.command, story.memory.light.held) == (None, False)


def test_without_a_word_about_pauses_motion_proves_the_resume() -> None:
    story = standing(paused=None)
    says(story.see(paused=None), "resume", 0).see(1.0)
    assert story.commands[-1][1] == "resume 2, attempt 1"
    story.see(moving=True)
    assert (story.memory.command, story.memory.light.held) == (None, False)


def test_a_robot_that_a_person_has_paused_is_not_resumed() -> None:  # FLEET-LIGHT-4
    story = started()
    says(story, "continue", 0).see(at=at(1.5), moving=False, paused=True)
    says(story, "resume", 0).see(60.0)
    assert story.memory.command is None
    text = "it is paused, and this daemon resumes only its own pauses"
    assert story.report.faults == (Fault("ROBOT_PAUSED_BY_OTHERS", text),)
    says(story, "stay", 0).see(5.0)
    assert story.memory.command is None, "it is paused already"
    story.take(OperatorReset())
    says(story, "resume", 0)
    assert story.commands[-1][1] == "resume 3, attempt 1"


def test_a_persons_pause_stays_a_persons_while_the_robot_still_rolls() -> None:  # FLEET-LIGHT-4
    story = started()
    says(story, "continue", 0).see(at=at(1.5), paused=True)
    says(story, "stay", 0)
    assert story.commands[-1][1] == "pause 3, attempt 1"
    assert not story.memory.light.held
    story.see(SCAN_S, at=at(1.6), moving=False)
    says(story, "resume", 0).see(60.0)
    assert story.memory.command is None
    assert story.faults == ["ROBOT_PAUSED_BY_OTHERS"]


def test_a_pause_that_goes_on_after_a_persons_pause_is_ours() -> None:  # FLEET-LIGHT-4
    story = started()
    says(story, "continue", 0).see(at=at(1.5), paused=True)
    says(story, "stay", 0).see(SCAN_S, at=at(1.8), paused=False)
    assert story.memory.light.held
    story.see(SCAN_S, at=at(1.9), moving=False, paused=True)
    says(story, "resume", 0)
    assert story.commands[-1][1] == "resume 4, attempt 1"


def test_a_pause_that_one_state_leaves_out_stays_a_persons() -> None:  # FLEET-LIGHT-4
    story = started()
    says(story, "continue", 0).see(at=at(1.5), paused=True)
    says(story, "stay", 0).see(SCAN_S, at=at(1.6), paused=None)
    assert not story.memory.light.held


@pytest.mark.parametrize("told", [PATH, (at(3.0), at(3.0, 4.0))])
def test_a_resume_that_was_not_obeyed_is_taken_back(told: tuple[Pose, ...]) -> None:
    """FLEET-LIGHT-4: RMF says `stay`, or the path is another one."""
    story = standing().see(paused=True)
    says(story, "resume", 0).see(1.0)
    says(story.see(path=told), "stay", 0)
    assert story.commands[-1][1] == "pause 3, attempt 1"
    says(story.see(20.0), "resume", 0, story.memory.light.number)
    assert story.commands[-1][1] == "resume 4, attempt 1"


def test_a_reset_makes_no_pause_of_a_robot_that_drives() -> None:  # FLEET-LIGHT-4
    story = started().take(OperatorReset())
    says(story, "continue", 0).see(at=at(1.5), moving=False, paused=True)
    says(story, "resume", 0)
    assert story.memory.command is None


def test_a_paused_robot_without_a_path_is_let_go() -> None:  # FLEET-LIGHT-4
    story = standing().see(paused=True).see(path=())
    assert story.commands[-1][1] == "resume 2, attempt 1"
    story.see(paused=None).see(3.0)
    assert story.memory.command is None


def test_a_restart_knows_whom_it_has_paused() -> None:  # FLEET-LIGHT-4
    held = standing().memory
    back = KEEPING.restore(KEEPING.persist(held), 7.0)
    assert (back.light.held, back.started_at, back.light.path) == (True, 7.0, ())
    assert not KEEPING.restore(KEEPING.persist(started().memory), 7.0).light.held
    assert not KEEPING.lost("no file").light.held
    with pytest.raises(ValueError, match="not the memory of a robot"):
        KEEPING.restore(b'{"held": 3}', 0.0)


# ---- the texts in the report


def test_its_doing_names_path_checkpoint_light_and_pause() -> None:
    story = standing(moving=True)
    way = "path to L1 lift1_L1, at checkpoint 0 of 3, RMF's light: "
    assert story.report.doing == way + "no answer, told to pause"
    story.see(SCAN_S, moving=False, paused=True)
    assert story.report.doing == way + "no answer, paused by us"
    says(says(story, "resume", 0).see(paused=False, moving=True), "continue", 0)
    assert story.report.doing == way + "continue"


def test_a_robot_that_drives_without_a_path_is_told() -> None:
    story = standing(path=(), moving=True)
    text = "it drives, and its manager tells no path"
    assert story.report.faults == (Fault("ROBOT_WITHOUT_PATH", text),)
    assert (story.memory.command, story.report.doing) == (None, "nothing")
    assert standing(path=()).faults == []
