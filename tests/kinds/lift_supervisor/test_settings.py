"""The supervisor's section of the YAML file. Each key must have an effect on the core's limits."""

import math
from pathlib import Path

import msgspec
import pytest
import yaml

from bridges.kinds.lift_supervisor import KIND
from bridges.kinds.lift_supervisor.memory import LiftSupervisorLimits
from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings

SHIPPED = Path(__file__).parents[3] / "config" / "lift_supervisor.yaml"


def read(text: str) -> LiftSupervisorSettings:
    return msgspec.convert(yaml.safe_load(text), LiftSupervisorSettings, strict=False)


def test_the_shipped_file_serves_every_lift_by_the_defaults() -> None:
    file = yaml.safe_load(SHIPPED.read_text())
    assert set(file) <= {"kind", "rmf", "supervisor"}
    assert file["kind"] == KIND.name
    assert msgspec.convert(file[KIND.devices_key], KIND.settings) == LiftSupervisorSettings()


def test_every_setting_reaches_the_core() -> None:
    settings = read(
        "{lifts: [Lift1], quiet_start_s: 4, silent_after_s: 20, holder_alarm_s: 30,"
        " holder_ttl_s: 90, clock_synchronised: true, max_request_age_s: 5}"
    )
    assert list(settings.problems()) == []
    assert KIND.limits(settings) == LiftSupervisorLimits(20.0, 4.0, 30.0, 90.0, True, 5.0)
    assert KIND.quiet_s(settings) == 4.0
    assert KIND.limits(LiftSupervisorSettings()) == LiftSupervisorLimits(holder_ttl_s=math.inf)


@pytest.mark.parametrize("wrong", ["{quiet_start_s: 1}", "{silent_after_s: 0}", "{lift: [x]}"])
def test_settings_that_cannot_be_right_are_refused(wrong: str) -> None:
    with pytest.raises(msgspec.ValidationError):
        read(wrong)


def test_an_alarm_must_come_before_its_end_and_lifts_are_all_named_or_left_out() -> None:
    problems = read("{lifts: [], holder_alarm_s: 60, holder_ttl_s: 60}").problems()
    assert [path for path, _ in problems] == [("holder_ttl_s",), ("lifts",)]
