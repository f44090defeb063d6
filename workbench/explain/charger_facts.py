"""Facts about one charger, from its messages.

The charger's story (a list of its events) also tells the requests and the refusals.
"""

from dataclasses import dataclass
from typing import Final

from bridges.kinds.charger import refusals
from bridges.messages.stamps import in_seconds
from bridges.observe.charger import CHARGING, NOBODY, ObservedCharger
from bridges.observe.news import News
from bridges.observe.requesters import Moment
from workbench.explain.device import DAEMON_REFUSES, Device
from workbench.explain.rows import label

SAME_S: Final = 3.0
"""The longest time (s) between the message of a refusal and the daemon's count of the same refusal."""


@dataclass(slots=True)
class HeardRefusal:
    """The last refusal heard for this charger."""

    who: str
    request: str
    text: str
    at: Moment


class ChargerFacts(Device, ObservedCharger):
    """A charger, its last refused request (`refusal`) and the number of charges that have begun
    (`charges`)."""

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.refusal: HeardRefusal | None = None
        self.charges = 0
        self._counted = ""

    @property
    def full_in_s(self) -> float:
        """The time (s) until the robot is full, according to the charger's last state."""
        return in_seconds(self.state.time_to_fully_charged) if self.state else 0.0

    def says(self, one: News) -> str:
        """Return a line of the story. Return "" if the story leaves the event out."""
        match one.what:
            case "asks" if one.requester:
                robot = one.requester.wants
                return f"{self.name} is asked to charge {robot} (request {one.who})"
            case "ends":
                return f"request {one.who} is cancelled"
            case "changed" if self.changed.keys() != {"request"}:
                whose = "" if self.robot.value == NOBODY else f" for {self.robot.value}"
                error = f": {self.error.value}" if self.error.value else ""
                return f"{self.name} is {self.condition.value}{whose}{error}"
        return ""

    def _reads(self, one: News) -> str:
        """Return the story line for an event that all kinds of device have. A refusal that `refused`
        has told gets no second line."""
        told = self.refusal
        if (
            one.what == "refused"
            and told is not None
            and told.text.partition(": ")[0] == one.text
            and one.at.at - told.at.at < SAME_S
        ):
            return ""
        return super()._reads(one)

    def notice(self, one: News) -> None:
        """Count the charges that begin. A charge that goes on after a pause is not counted again."""
        began = one.what == "changed" and self.changed.keys() != {"request"}
        if began and self.condition.value == CHARGING:
            request = self.request.value
            self.charges += not request or request != self._counted
            self._counted = request

    def refused(self, moment: Moment, refusal: refusals.ChargerRefusal) -> None:
        """Remember a refused request and its reason."""
        who, text = label(refusal.robot), label(refusal.text, 300)
        last = self.refusal
        if last is None or (last.request, last.text) != (label(refusal.request_id), text):
            self._untell(moment, DAEMON_REFUSES + text.partition(": ")[0])
            refused = (
                f"{self.name} refuses {who}" if self.state else f"a request of {who} is refused"
            )
            self.tell(moment, f"{refused}: {text}")
        self.refusal = HeardRefusal(who, label(refusal.request_id), text, moment)

    def _untell(self, moment: Moment, text: str) -> None:
        """Take the story's last line back, if it has this text and is as new as SAME_S."""
        if self.lines and self.lines[-1].text == text and moment.at - self.lines[-1].at < SAME_S:
            self.lines.pop()
