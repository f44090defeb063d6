"""`rmf-bridge press` and `fail` on the simulated devices of a lift."""

import logging
from collections.abc import Iterator
from pathlib import Path

import pytest

from bridges import cli
from hal_fakes.control import Control
from hal_fakes.plants.lift import LiftPlant
from hal_fakes.realtime import RealTime
from tests.hal_fakes.virtual_lift import shipped

FILE = str(Path(__file__).parents[3] / "config" / "lift_dry_contact.yaml")


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[LiftPlant]:
    lift = LiftPlant("Lift1", shipped())
    running = RealTime({"Lift1": lift})
    control = Control(tmp_path / "plant.sock", running.plants)
    yield lift
    control.close()
    running.close()


def say(tmp_path: Path, *words: str) -> int:
    return cli.main([words[0], FILE, *words[1:], "--runtime-dir", str(tmp_path)])


def test_a_button_is_pressed_and_let_go(plant: LiftPlant, tmp_path: Path) -> None:
    assert say(tmp_path, "press", "fire_alarm") == 0
    assert plant.contact("fire_alarm")
    assert say(tmp_path, "press", "fire_alarm", "off") == 0
    assert not plant.contact("fire_alarm")


def test_a_part_fails_and_is_mended(plant: LiftPlant, tmp_path: Path) -> None:
    assert say(tmp_path, "fail", "car", "stuck") == 0
    assert plant.failures == {"car": "stuck"}
    assert say(tmp_path, "fail", "car", "ok") == 0
    assert plant.failures == {}


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (("press", "fire"), "Lift1 has no 'fire' to press; there are fire_alarm, code_blue"),
        (
            ("fail", "rope", "stuck"),
            "Lift1 has no part 'rope'; there are agv_mode, agv_mode_request",
        ),
        (("fail", "car", "garbage"), "car does not fail by 'garbage', but by off, stuck"),
        (("press", "fire_alarm", "--device", "Lift2"), "no device 'Lift2'; there are Lift1"),
    ],
)
def test_an_unknown_name_is_answered_with_those_that_exist(
    plant: LiftPlant,
    tmp_path: Path,
    words: tuple[str, ...],
    answer: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert say(tmp_path, *words) == 1
    assert capsys.readouterr().err.startswith(answer)


def test_each_press_and_failure_is_confirmed_and_is_in_the_simulations_log(
    plant: LiftPlant,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO, "hal_fakes")
    say(tmp_path, "press", "fire_alarm")
    say(tmp_path, "fail", "car", "stuck")
    say(tmp_path, "fail", "car", "ok")
    assert capsys.readouterr().out.splitlines() == [
        "Lift1: fire_alarm on",
        "Lift1: car stuck",
        "Lift1: car ok",
    ]
    assert caplog.messages == [
        "pressed device=Lift1 signal=fire_alarm to=on",
        "failed device=Lift1 part=car mode=stuck",
        "mended device=Lift1 part=car mode=ok",
    ]


def test_without_a_name_the_names_are_printed(
    plant: LiftPlant, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (say(tmp_path, "press"), say(tmp_path, "fail")) == (0, 0)
    known = plant.names()
    assert capsys.readouterr().out.splitlines() == [
        f"Lift1: {', '.join(known['press'])}",
        f"Lift1: {', '.join(known['fail'])}",
    ]


def test_a_part_without_a_failure_is_answered_with_the_failures(
    plant: LiftPlant, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        say(tmp_path, "fail", "car")
    assert left.value.code == 2
    assert "give a MODE for car: off, stuck, slow, garbage, wrong; or ok" in capsys.readouterr().err


@pytest.mark.parametrize("words", [("press",), ("press", "fire_alarm")])
def test_without_a_simulation_the_answer_is_how_to_start_one(
    words: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert say(tmp_path, *words) == 69
    assert f"rmf-bridge run {FILE} --simulate" in capsys.readouterr().err
