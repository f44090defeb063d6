"""What `send charger --queue` wants: the coordinator's choice for a robot, or that withdrawn."""

from typing import Any

from bridges.commands.effects import Done, SoFar, nobody_listens
from bridges.commands.wishes import SERVING
from bridges.rmf import definitions as d
from bridges.rmf import topics, words
from bridges.rmf.stamps import duration
from bridges.rmf.topics import Topic

ANY = "any"
WHO = "charger coordinator"


class Queue:
    """Some charger that serves this robot; `charger` rather than another, unless it is ANY."""

    states: Topic[Any] = topics.CHARGER_STATES
    topic: Topic[Any] = topics.ADAPTER_CHARGER_REQUESTS
    nobody = nobody_listens(topics.ADAPTER_CHARGER_REQUESTS, None, WHO)

    def __init__(
        self, charger: str, fleet: str, robot: str, request_id: str, start_timeout_s: float
    ) -> None:
        self.fleet, self.robot, self.request_id = fleet, robot, request_id
        self.name = f"{fleet}/{robot}"
        charger = "" if charger == ANY else charger
        self._request = d.ChargerRequest(
            charger, fleet, robot, duration(start_timeout_s), request_id
        )

    def request(self, so_far: SoFar) -> d.ChargerRequest:
        """The same id each time, so that a repeat is no new wish."""
        return self._request

    def about(self, state: words.Stated) -> bool:
        """A charger that shows this robot."""
        return isinstance(state, d.ChargerState) and (
            (state.robot_fleet, state.robot_name) == (self.fleet, self.robot)
        )

    def met(self, so_far: SoFar) -> bool:
        """Some charger is heard."""
        return bool(so_far.names)

    def outcome(self, so_far: SoFar) -> Done | None:
        """A charger serves it."""
        answer = so_far.answer()
        if answer is None or answer.state not in SERVING:
            return None
        state = words.word(d.ChargerStateValue, answer.state)
        return Done(words.printable(f"{answer.charger_name} is {state} for {self.name}"))

    def unheard(self, names: frozenset[str]) -> str:
        """It waits, as far as one can see."""
        if not names:
            return "no charger is heard: are their daemons running, in this domain?"
        return (
            f"no charger serves {self.name} yet: it waits in the {WHO}'s queue, or that one's log"
            f" says why not; `rmf-bridge send charger {ANY} --queue --cancel {self.request_id}`"
            " withdraws it"
        )

    def reason(self, so_far: SoFar) -> str:
        """What the charger says that has it."""
        state: d.ChargerState = so_far.latest()
        if state.state == d.ChargerStateValue.CHARGER_ERROR:
            return words.printable(f"{state.charger_name} reports: {state.error_message}")
        return f"the {WHO} has not given it a charger: its log says why"


class Withdrawal:
    """A wish withdrawn; nothing but the coordinator's own status shows the queue."""

    states: Topic[Any] = topics.CHARGER_STATES
    topic: Topic[Any] = topics.ADAPTER_CHARGER_CANCELS
    nobody = nobody_listens(topics.ADAPTER_CHARGER_CANCELS, None, WHO)

    def __init__(self, request_id: str) -> None:
        self.name = self.request_id = request_id

    def request(self, so_far: SoFar) -> d.ChargerCancel:
        """By its id."""
        return d.ChargerCancel("", self.request_id)

    def about(self, state: words.Stated) -> bool:
        """No state tells."""
        return False

    def met(self, so_far: SoFar) -> bool:
        """Some charger is heard."""
        return bool(so_far.names)

    def outcome(self, so_far: SoFar) -> Done | None:
        """The coordinator was told."""
        if so_far.first_sent_at is None:
            return None
        return Done(words.printable(f"the {WHO} was told that {self.request_id} is withdrawn"))

    def unheard(self, names: frozenset[str]) -> str:
        """Nobody was told."""
        return f"the {WHO} could not be told"

    def reason(self, so_far: SoFar) -> str:
        """Nobody was told."""
        return self.unheard(frozenset())
