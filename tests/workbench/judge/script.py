"""A simulated node that publishes given messages at given times."""

from collections.abc import Sequence

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from bridges.messages.topics import AnyTopic
from tests.site.timeline import EPOCH
from workbench.rmf_model import NEVER, Party, Said


class Script(Party):
    """A simulated node that publishes `lines` in order. Each line is (time in s, topic, message)."""

    subscribes: Sequence[AnyTopic] = ()

    def __init__(self, *lines: tuple[float, AnyTopic, d.Message]) -> None:
        self._lines = list(lines)

    def hear(self, message: d.Message, now: float) -> list[Said]:
        return []

    def tick(self, now: float) -> list[Said]:
        said: list[Said] = []
        while self._lines and self._lines[0][0] + EPOCH <= now + 1e-6:
            _, topic, message = self._lines.pop(0)
            said.append((topic, message))
        return said

    def wake_at(self) -> float:
        return self._lines[0][0] + EPOCH if self._lines else NEVER


def lift(session: str, floor: str, lift: str = "Lift1", kind: int = 1) -> d.LiftRequest:
    """Return a LiftRequest that asks for an open door. `kind` 0 means END."""
    return d.LiftRequest(lift, stamp(EPOCH), session, kind, floor, 2 if kind else 0)


def asks(at: float, session: str, floor: str, times: int = 1) -> Script:
    """Return a node that publishes this request on lift_requests once a second."""
    request = lift(session, floor)
    return Script(*((at + n, topics.LIFT_REQUESTS, request) for n in range(times)))


def door(mode: int, who: str = "door_supervisor", name: str = "ward") -> d.DoorRequest:
    """Return a DoorRequest."""
    return d.DoorRequest(stamp(EPOCH), who, name, d.DoorMode(mode))


def to_door(*modes: tuple[float, int]) -> Script:
    """Return a node that sends each mode on door_requests. Each item is (time in s, mode)."""
    return Script(*((at, topics.DOOR_REQUESTS, door(mode)) for at, mode in modes))


def charge(at: float, robot: str, request_id: str, timeout_s: int = 20) -> Script:
    """Return a node that sends one ChargerRequest."""
    request = d.ChargerRequest("bay1", "fleet", robot, d.Duration(timeout_s), request_id)
    return Script((at, topics.CHARGER_REQUESTS, request))
