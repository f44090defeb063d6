"""RMF's messages in virtual time, and what our observers note about the devices in these messages."""

from dataclasses import dataclass, field

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.messages.words import Kind
from bridges.observe.all_devices import AnyDevice, PlainGraph
from bridges.observe.requesters import Moment
from bridges.observe.tally import SiteTally

WALL = 1_800_000_000.0
RED, BLUE = "fleet/red", "fleet/blue"
LIFT = d.LiftState(lift_name="Lift1", available_floors=("L1", "L2"), current_floor="L1")
DOOR = d.DoorState(door_name="ward")
CHARGER = d.ChargerState(charger_name="bay", state=1)
END, AGV, HUMAN = 0, 1, 2
OPEN, CLOSED = 2, 0


@dataclass
class Story:
    """A series of messages. `news` has a line for each thing that the observer has noted as new."""

    graph: PlainGraph = field(default_factory=PlainGraph)
    tally: SiteTally = field(default_factory=SiteTally)
    now: float = 0.0
    news: list[str] = field(default_factory=list)

    def hear(self, topic: str, message: d.Message) -> "Story":
        """Let a message arrive now."""
        heard = Heard(self.now, WALL + self.now, topic, message)
        found = self.graph.hear(heard)
        self.tally.take(self.graph, found)
        for _, news in found:
            for one in news:
                said = one.what, one.who, one.text, "passed on" if one.passed_on else ""
                self.news.append(f"{self.now:g} {' '.join(filter(None, said))}")
        return self

    def passes(self, seconds: float) -> "Story":
        """Let time pass."""
        self.now += seconds
        return self

    def told(self) -> list[str]:
        """Return the news since the last call."""
        told, self.news = self.news, []
        return told

    def device(self, kind: Kind, name: str) -> AnyDevice:
        """Return the device of this name."""
        return self.graph.known[kind, name]

    def waits(self, kind: Kind, name: str) -> list[tuple[str, str, float]]:
        """Return (requester, request, time) for each requester that waits. The time (s) is the start of
        its wait."""
        now = Moment(self.now, WALL + self.now)
        return [(one.who, one.wants, one.since.at) for one in self.device(kind, name).waits(now)]

    # ---- messages

    def lift(self, session: str = "", floor: str = "L1", door: int = CLOSED) -> "Story":
        """Let a LiftState arrive."""
        said = replace(LIFT, session_id=session, current_floor=floor, door_state=door)
        return self.hear("lift_states", replace(said, lift_time=stamp(WALL + self.now)))

    def asks(
        self, who: str, floor: str = "L2", kind: int = AGV, *, passed: bool = False
    ) -> "Story":
        """Let a LiftRequest of a robot arrive. The fleet adapter sends it, or the supervisor if
        `passed` is true."""
        topic = "lift_requests" if passed else "adapter_lift_requests"
        floor = "" if kind == END else floor
        return self.hear(topic, d.LiftRequest("Lift1", stamp(WALL + self.now), who, kind, floor))

    def ends(self, who: str, *, passed: bool = False) -> "Story":
        """Let an END_SESSION of a robot arrive. `passed` is the same as for `asks`."""
        return self.asks(who, kind=END, passed=passed)

    def door(self, mode: int) -> "Story":
        """Let a DoorState arrive."""
        said = replace(DOOR, door_time=stamp(WALL + self.now), current_mode=d.DoorMode(mode))
        return self.hear("door_states", said)

    def asks_door(
        self, who: str, mode: int = OPEN, topic: str = "adapter_door_requests"
    ) -> "Story":
        """Let a DoorRequest arrive."""
        return self.hear(topic, d.DoorRequest(stamp(WALL), who, "ward", d.DoorMode(mode)))

    def lists(self, *holders: str) -> "Story":
        """Let the door supervisor's heartbeat arrive with these holders."""
        sessions = tuple(d.Session(requester_id=who) for who in holders)
        listed = (d.DoorSessions("ward", sessions),) if sessions else ()
        return self.hear("door_supervisor_heartbeat", d.SupervisorHeartbeat(listed))
