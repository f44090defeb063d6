"""Observation of a charger: its requesters, its holder, its charge."""

from collections.abc import Iterator
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.stamps import in_seconds
from bridges.observe.device import ObservedDevice, Wait
from bridges.observe.limits import UNSEEN_S
from bridges.observe.news import News
from bridges.observe.requesters import Fact, Moment

NOBODY: Final = "nobody"
CHARGING: Final = "charging"


class ObservedCharger(ObservedDevice[d.ChargerState]):
    """A charger, as observed. A requester is a request for charging, and its name is the request's id.

    - `condition`: RMF's word for the charger's state
    - `robot`: the robot that has the charger. It is unknown before the first state, and while no states
      arrive.
    - `request`: the id of the present request
    """

    kind = "charger"

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.condition = Fact("", began)
        self.robot = Fact(NOBODY, began)
        self.request = Fact("", began)
        self.error = Fact("", began)

    def facts(self, state: d.ChargerState) -> dict[str, str]:
        """Return condition, robot, error and request."""
        robot = f"{state.robot_fleet}/{state.robot_name}" if state.robot_name else NOBODY
        return {
            "condition": words.plain(d.ChargerStateValue, state.state),
            "robot": self.text(robot),
            "error": self.text(state.error_message),
            "request": self.text(state.request_id),
        }

    def waits(self, now: Moment) -> Iterator[Wait]:
        """Yield the wait of the robot to which the charger is assigned. The wait is taken from the
        charger's state, because RMF sends the request for a charger only once."""
        if self.condition.value == "assigned":
            since = max(self.condition.since, self.request.since, key=lambda one: one.at)
            yield Wait(self.request.value, "CHARGING", since)

    def _hear_other(self, moment: Moment, topic: str, message: d.Message) -> Iterator[News]:
        match message:
            case d.ChargerRequest():
                robot = self.text(f"{message.fleet_name}/{message.robot_name}")
                who = self.text(message.request_id)
                one, new = self.requesters.ask(who, robot, moment, stands=True)
                one.stands_s = in_seconds(message.start_timeout)
                if new and one.times == 1:
                    yield News("asks", moment, one.who, requester=one)
            case d.ChargerCancel():
                found = self.requesters.get(self.text(message.request_id))
                if found is not None and found.ended is None:
                    found.ended = moment
                    yield News("ends", moment, found.who, requester=found)

    def _settle(self, moment: Moment) -> Iterator[News]:
        if self.changed and self.before is not None:
            yield News("changed", moment)
        if self.before is None or self.gap_s > UNSEEN_S:
            self.robot.since = Moment(moment.at, moment.wall, seen=False)
        if found := self.requesters.get(self.request.value):
            found.granted = found.granted or moment
