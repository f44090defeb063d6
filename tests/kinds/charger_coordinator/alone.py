"""The coordinator's core with two stations, without network or daemon, in virtual time."""

from typing import Any

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator import core
from bridges.kinds.charger_coordinator.memory import (
    CHARGING,
    IDLE,
    SiteLimits,
    SiteMemory,
)
from bridges.kinds.charger_coordinator.report import SiteReport
from bridges.kinds.charger_coordinator.signals import ChargerStateHeard, Event, FleetSeen, Sighting
from bridges.kinds.shared.graph_kind import Woken
from bridges.messages import definitions as d
from tests.kinds.charger_coordinator.virtual_site import settings
from tests.kinds.shared import alone

SETTINGS = settings()


ONE, TWO, THREE = (RobotName("tiny", f"AMR0{i}") for i in (1, 2, 3))


A, B = "charger_a", "charger_b"


class Alone(alone.Alone[SiteMemory, Event, SiteLimits, SiteReport]):
    """The coordinator's core alone. Tests give it messages through `run`.

    `shows` has the ChargerState that each station shows. `seen` has the robots that the fleets report.
    """

    def __init__(self) -> None:
        self.shows = {name: ChargerStateHeard(name, IDLE) for name in (A, B)}
        self.seen: dict[RobotName, Sighting] = {}
        super().__init__(core.initial("site", 0.0), core.decide, SiteLimits.of(SETTINGS), True)

    def words(self, message: d.Message) -> str:
        """Describe a request or cancel to a station in words. Return "" for any other message."""
        match message:
            case d.ChargerRequest():
                return f"{message.charger_name}: {message.robot_name}"
            case d.ChargerCancel():
                return f"{message.charger_name}: cancel"
        return ""

    @property
    def faults(self) -> list[str]:
        return [str(fault) for fault in self.report.faults]

    def run(self, seconds: int) -> list[tuple[float, str]]:
        """Let this many seconds pass, one by one. Return the messages sent in that time."""
        said = len(self.sent)
        for _ in range(seconds):
            self.now += 1.0
            for shown in self.shows.values():
                self.hears(shown)
            for sighting in self.seen.values():
                self.hears(FleetSeen((sighting,)))
            self.hears(Woken())
        return self.sent[said:]

    def wants(self, who: RobotName, place: str | None = None, percent: float = 40.0) -> None:
        """Let the fleet report from now on that this robot wants to charge."""
        place = f"wait_{who.name[-1]}" if place is None else place
        self.seen[who] = Sighting(who, True, place, percent, f"task of {who.name}")

    def does(self, station: str, state: Any, error: str = "") -> None:
        """Let the station show this state, and the coordinator's last request to this station, from now
        on."""
        grant = self.memory.grants[station]
        self.shows[station] = ChargerStateHeard(
            station, state, grant.request_id, grant.robot, error
        )


def busy(station: str) -> ChargerStateHeard:
    """Return the state of a station that serves a robot of another site."""
    return ChargerStateHeard(station, CHARGING, "somebody-1", RobotName("other", "robot"))
