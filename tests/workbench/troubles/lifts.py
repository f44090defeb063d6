"""Troubles at Lift1. RMF's own supervisor serves it, unless the docstring names another supervisor."""

from typing import Final

from msgspec.structs import replace

from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import in_seconds, stamp
from drivers.hal.modbus.points import parse
from tests.workbench.troubles.fleet import PartyNode
from tests.workbench.troubles.module import ModuleFar
from tests.workbench.troubles.site import LIFT, Site, devices
from workbench.rmf_model import Said
from workbench.rmf_model.supervisors import LiftSupervisor

RMFS: Final = "rmf_lift_supervisor"
SUPERVISOR: Final = "lift_supervisor"
HOUR_S: Final = 3600.0
OLD_S: Final = 10.0
FLICKERS_S: Final = 1.6


def robot_dies_in_car(site: Site) -> None:
    """Let the adapter fall silent for the robot in the car. The adapter still asks for another
    robot."""
    site.boards(site.red, "L1", "L3")
    site.run(4.0)
    site.blue.asks(LIFT, "L1")
    site.until(site.red)
    site.run(2.0)
    site.trouble_begins()
    site.red.is_dropped()
    site.run(120.0)


def robot_dies_in_car_b(site: Site) -> None:
    """Let the robot die in the car. The robot's adapter does not notice."""
    site.boards(site.red, "L1", "L3")
    site.run(4.0)
    site.trouble_begins()
    site.blue.asks(LIFT, "L1")
    site.until(site.red)
    site.run(150.0)


def fire_mid_ride(site: Site) -> None:
    """Let a fire begin during a ride. The car goes down to the recall floor, and the adapter asks for
    that floor."""
    _fire_between_floors(site)
    site.red.asks(LIFT, "L1", inside=True)
    site.run(5.0)


def fire_mid_ride_to_its_end(site: Site) -> None:
    """Let a fire begin during a ride. The robot leaves the car at the recall floor."""
    fire_mid_ride(site)
    robot_leaves(site)


def robot_leaves(site: Site) -> None:
    """Let the robot in the car reach its floor, and drive out."""
    site.until(site.red)
    site.run(2.0)
    site.red.ends(LIFT)
    site.until(site.red)


def fire_mid_ride_b(site: Site) -> None:
    """Let a fire begin during a ride. The car stands open at the recall floor, but the adapter still
    asks for L3."""
    _fire_between_floors(site)
    site.run(80.0)


def lift_door_contact_cut(site: Site) -> None:
    """Cut the door's 'opened' wire during a ride."""
    site.boards(site.red, "L1", "L3")
    site.run(8.0)
    site.trouble_begins()
    site.fail(LIFT, "door_opened", "off")
    site.run(45.0)


def supervisor_killed(site: Site) -> None:
    """Kill RMF's supervisor. Then two robots ask for the free lift."""
    site.rides(site.red, LIFT, "L1", "L2")
    site.run(5.0)
    site.supervisors[RMFS].kill()
    site.run(60.0)
    site.trouble_begins()
    site.red.asks(LIFT, "L1")
    site.blue.asks(LIFT, "L3")
    site.run(20.0)


def supervisor_killed_b(site: Site) -> None:
    """Kill RMF's supervisor during a ride. The robot leaves the car, and its adapter sends END."""
    site.boards(site.red, "L1", "L3")
    site.run(5.0)
    site.trouble_begins()
    site.supervisors[RMFS].kill()
    site.blue.asks(LIFT, "L1")
    site.until(site.red)
    site.run(6.0)
    site.red.ends(LIFT)
    site.run(120.0)


def rmf_silent_robot_asks(site: Site) -> None:
    """Kill RMF's supervisor shortly after the robot has boarded."""
    site.red.asks(LIFT, "L1")
    site.until(site.red)
    site.run(3.0)
    site.trouble_begins()
    site.supervisors[RMFS].kill()
    site.run(5.0)
    site.red.asks(LIFT, "L3", inside=True)
    site.run(60.0)


def slow_modbus_unit(site: Site) -> None:
    """Make the lift's Modbus unit slow, so that it answers in time only sometimes."""
    site.run(5.0)
    site.trouble_begins()
    site.slow(LIFT)
    site.run(10.0)
    site.blue.asks(LIFT, "L2")
    site.run(40.0)


def two_daemons_one_name(site: Site) -> dict[str, str]:
    """Start a second daemon of ours for another lift. The second daemon publishes under the first
    lift's name."""
    site.rides(site.red, LIFT, "L2", "L1")
    site.run(60.0)
    site.trouble_begins()
    other = devices(site.timeline)[LIFT]
    site.serve(other, "rmf_bridge_lift_north")
    site.press("lift_north", "hall_L3", True)
    site.press("lift_north", "obstruction", True)
    site.red.asks(LIFT, "L1")
    site.run(40.0)
    return {"node_a": f"rmf_bridge_{LIFT}", "node_b": "rmf_bridge_lift_north"}


def two_foreign_nodes(site: Site) -> dict[str, str]:
    """Let two nodes of another maker publish the same states. Our supervisor serves the lifts."""
    site.retires(LIFT)
    site.takes_over(LiftSupervisorSettings())
    site.run(20.0)
    site.trouble_begins()
    Foreign(site, "lift_gateway")
    site.run(0.4)
    Foreign(site, "old_lift_gateway", behind_s=0.7)
    site.run(60.0)
    return {"node_a": "lift_gateway", "node_b": "old_lift_gateway"}


def robot_clock_hour_off(site: Site) -> None:
    """Set the adapter's clock back by an hour. The lift's supervisor is of another maker, and drops old
    requests.

    Our own supervisor would not show this trouble, because it believes a requester that repeats its
    request (FRESHNESS-5).
    """
    site.supervisors[RMFS].kill()
    PartyNode(
        site.timeline,
        site.join,
        site.wall,
        "site_lift_supervisor",
        StrictSupervisor(),
        [topics.LIFT_REQUESTS],
    ).start()
    site.trouble_begins()
    site.fleet.behind_s = HOUR_S
    site.red.asks(LIFT, "L1")
    site.run(30.0)


def robot_clock_hour_off_b(site: Site) -> None:
    """Set the adapter's clock an hour ahead, and let a robot ride. RMF's supervisor serves the lift."""
    site.fleet.behind_s = -HOUR_S
    site.trouble_begins()
    site.boards(site.red, "L1", "L3")
    site.blue.asks(LIFT, "L1")
    site.run(4.0)


def daemon_killed(site: Site) -> None:
    """Kill the lift's daemon during a ride."""
    site.boards(site.red, "L1", "L3")
    site.run(8.0)
    site.trouble_begins()
    site.kills(LIFT)
    site.run(30.0)


def fleet_adapter_killed(site: Site) -> None:
    """Kill the fleet adapter while one of its robots is in the car. Another of its robots waits."""
    site.boards(site.red, "L1", "L3")
    site.blue.asks(LIFT, "L2")
    site.until(site.red)
    site.run(3.0)
    site.trouble_begins()
    site.fleet.kill()
    site.run(30.0)


def human_mode_with_fault(site: Site) -> None:
    """Let the relay for AGV mode fail. Whatever the daemon writes, the daemon reads back that the relay
    is off."""
    far = site.devices[LIFT].far
    assert isinstance(far, ModuleFar)
    far.dead = frozenset({parse("unit 1 coil 0")})
    site.trouble_begins()
    site.red.asks(LIFT, "L1")
    site.run(40.0)


def human_mode_relays_off(site: Site) -> None:
    """Let an unsteady input switch the relays off again and again. Stop when the daemon leaves the
    relays off for a while (RELAY_RESTS)."""
    site.red.asks(LIFT, "L1")
    while not site.daemons[LIFT].faults() or "RELAY_RESTS" not in site.daemons[LIFT].faults():
        site.trouble_begins()
        site.press(LIFT, "manual_mode", True)
        site.run(0.2)
        site.press(LIFT, "manual_mode", False)
        site.run(FLICKERS_S)


def human_mode_asked(site: Site) -> None:
    """Let the relay ask for AGV mode. The controller does not confirm AGV mode."""
    site.fail(LIFT, "controller", "off")
    site.trouble_begins()
    site.red.asks(LIFT, "L1")
    site.run(75.0)


def _fire_between_floors(site: Site) -> None:
    site.boards(site.red, "L1", "L3")
    site.run(18.0)
    site.trouble_begins()
    site.press(LIFT, "fire_alarm", True)


class StrictSupervisor(LiftSupervisor):
    """A supervisor that drops requests older than OLD_S seconds."""

    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.LiftRequest) and now - in_seconds(message.request_time) > OLD_S:
            return []
        return super().hear(message, now)


class Foreign:
    """A lift node of another maker. The node publishes the same state each second. The node's clock is
    `behind_s` seconds slow."""

    def __init__(self, site: Site, node: str, behind_s: float = 0.0) -> None:
        self._site = site
        self._behind_s = behind_s
        self._mouth = site.join(node).publisher(topics.LIFT_STATES)
        self._state = d.LiftState(
            lift_name=LIFT,
            available_floors=("L1", "L2", "L3", "L4"),
            current_floor="L1",
            current_mode=d.LiftMode.MODE_AGV,
        )
        self._say()

    def _say(self) -> None:
        at = stamp(self._site.wall() - self._behind_s)
        self._mouth.publish(replace(self._state, lift_time=at))
        self._site.timeline.after(1.0, self._say)
