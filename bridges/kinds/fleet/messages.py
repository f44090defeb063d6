"""RMF's messages about a robot: the robot's state as our node would publish it, and the states of
chargers that name the robot."""

from collections.abc import Mapping

from bridges.kinds.fleet.report import RobotReport
from bridges.kinds.fleet.settings import FleetRobotSettings
from bridges.kinds.fleet.signals import PadHeard
from bridges.messages.constants import ChargerStateValue, RobotModeValue
from bridges.messages.definitions import (
    ChargerState,
    FleetState,
    Location,
    RobotMode,
    RobotState,
    Time,
)

CHARGES = (ChargerStateValue.CHARGER_CHARGING,)


def robot_of(message: ChargerState | FleetState) -> str:
    """Return the robot that a charger's state names; "" for other messages."""
    return message.robot_name if isinstance(message, ChargerState) else ""


def accept(message: ChargerState, settings: FleetRobotSettings) -> PadHeard:
    """Turn a charger's state that names this robot into an event. No such state is refused."""
    charging = message.state in CHARGES
    return PadHeard(message.charger_name, charging, message.error_message)


def state_message(
    name: str, settings: FleetRobotSettings, report: RobotReport, stamp: Time
) -> FleetState:
    """Return the robot's state in RMF's form.

    RMF's adapter publishes the states of the robots that it controls. For a robot with a traffic light
    it publishes no state, because EasyTrafficLight.cpp makes the message and drops it.
    """
    at = report.light.here if report.light else report.at
    place = Location(t=stamp, x=at.x, y=at.y, yaw=at.yaw, level_name=at.map) if at else Location()
    moves = report.light.stands == "moving" if report.light else report.activity
    mode = RobotModeValue.MODE_MOVING if moves else RobotModeValue.MODE_IDLE
    if report.light and report.light.held:
        mode = RobotModeValue.MODE_PAUSED
    robot = RobotState(
        name=name,
        mode=RobotMode(mode=mode),
        battery_percent=100.0 * report.battery,
        location=place,
    )
    return FleetState(robots=(robot,))


def summary(report: RobotReport) -> Mapping[str, str]:
    """Return the robot's state as keys and values for the log, the status file and `watch`."""
    tasks = {} if report.fit is None else {"new_tasks": "yes" if report.fit else "no"}
    return {
        "at": report.where,
        "doing": report.doing,
        "battery": f"{10 * round(10 * report.battery)} %" if report.read_at is not None else "-",
        **tasks,
    }
