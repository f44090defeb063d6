"""What was heard of one charger: its state, who asked for it, who was refused, and the coordinator."""

from dataclasses import dataclass
from typing import Final

from bridges.kinds.charger import refusals
from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.stamps import in_seconds
from workbench.explain.claims import Claims
from workbench.explain.device import Device, Fact
from workbench.explain.phrases import Moment
from workbench.explain.rows import label
from workbench.explain.timeline import Kind

NOBODY: Final = "nobody"
COORDINATOR: Final = "charger_coordinator"


@dataclass(slots=True)
class Refusal:
    """The last refusal that was heard of this charger."""

    who: str
    request: str
    text: str
    at: Moment


class ChargerFacts(Device):
    """`robot`: the robot that has it. `request`: the id that it serves. `full_in_s`: as it last
    said."""

    kind: Kind = "charger"

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.claims = Claims(began)
        self.state = Fact("", began)
        self.robot = Fact(NOBODY, began)
        self.request = Fact("", began)
        self.error = Fact("", began)
        self.full_in_s = 0.0
        self.refusal: Refusal | None = None
        self.charges = 0

    def stated(self, moment: Moment, state: d.ChargerState) -> None:
        """A state of the charger."""
        first = self.last_state is None
        moment = self.state_came(moment, words.stamped_at(state))
        said = words.plain(d.ChargerStateValue, state.state)
        robot = f"{state.robot_fleet}/{state.robot_name}" if state.robot_name else NOBODY
        changed = self.state.say(said, moment)
        changed |= self.robot.say(label(robot), moment)
        changed |= self.error.say(label(state.error_message), moment)
        self.request.say(label(state.request_id), moment)
        self.full_in_s = in_seconds(state.time_to_fully_charged)
        if changed and not first:
            whose = "" if robot == NOBODY else f" for {self.robot.value}"
            error = f": {self.error.value}" if state.error_message else ""
            self.tell(moment, f"{self.name} is {said}{whose}{error}")
            self.charges += said == "charging"
        claim = self.claims.get(self.request.value)
        if claim is not None:
            claim.granted = claim.granted or moment

    def requested(self, moment: Moment, request: d.ChargerRequest) -> None:
        """A request to this charger."""
        robot = label(f"{request.fleet_name}/{request.robot_name}")
        claim, new = self.claims.ask(label(request.request_id), robot, moment)
        if new and claim.times == 1:
            self.tell(moment, f"{self.name} is asked to charge {robot} (request {claim.who})")

    def cancelled(self, moment: Moment, cancel: d.ChargerCancel) -> None:
        """A request is withdrawn."""
        claim = self.claims.get(label(cancel.request_id))
        if claim is not None and claim.ended is None:
            claim.ended = moment
            self.tell(moment, f"request {claim.who} is cancelled")

    def refused(self, moment: Moment, refusal: refusals.Refusal) -> None:
        """A request was refused, and why."""
        who, text = label(refusal.robot), label(refusal.text, 300)
        last = self.refusal
        if last is None or (last.request, last.text) != (label(refusal.request_id), text):
            self.tell(moment, f"{self.name} refuses {who}: {text}")
        self.refusal = Refusal(who, label(refusal.request_id), text, moment)
