"""The history of a charger, with its requests and states."""

from typing import Final

from bridges.messages import definitions as d
from bridges.messages.heard import Heard
from bridges.observe.charger import ObservedCharger
from workbench.judge.history import NOT_YET, History, keep

IDLE: Final = d.ChargerStateValue.CHARGER_IDLE
ASSIGNED: Final = d.ChargerStateValue.CHARGER_ASSIGNED
CHARGING: Final = d.ChargerStateValue.CHARGER_CHARGING
RELEASED: Final = d.ChargerStateValue.CHARGER_RELEASED
ERROR: Final = d.ChargerStateValue.CHARGER_ERROR
LOST: Final = float("inf")
"""Time that is recorded for a cancel, if the station may not have received the cancel."""
UNREQUESTED: Final = "unrequested/"
"""Prefix of the id of a charge that nobody requested. A station may use such an id again later."""


class ChargerHistory(History[d.ChargerState]):
    """The history of one charger.

    - `requests`: id -> the latest request.
    - `first_asked`: id -> time of the first request.
    - `elsewhere`: ids of requests to other stations.
    - `second_at`: time of the last request that came while the station served another request.
    - `cancels`: id -> time of the first cancel. The cancel of an unrequested charge is forgotten when
      that charge ends.
    - `foreign_at`: time of the last cancel of an id that the station does not show.
    - `same_since`: since when the station has shown its present combination of state and request.
    - `same_before`: since when it had shown the combination before that.
    """

    seen: ObservedCharger
    observes = ObservedCharger

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.requests: dict[str, d.ChargerRequest] = {}
        self.cancels: dict[str, float] = {}
        self.first_asked: dict[str, float] = {}
        self.elsewhere: dict[str, float] = {}
        self.foreign_at = self.second_at = self.same_since = self.same_before = NOT_YET

    @staticmethod
    def claims(state: d.ChargerState) -> bool:
        """Return whether a robot would act on this state. This is true for every state except ERROR."""
        return state.state != ERROR

    def take_other(self, heard: Heard) -> bool:
        """Take a request or a cancel. Return whether the message was for this charger."""
        match heard.message:
            case d.ChargerRequest(charger_name=self.name):
                self.asked()
                if not unrequested(heard.message.request_id):
                    keep(self.requests, heard.message.request_id, heard.message)
                    first_at = self.first_asked.get(heard.message.request_id, self.now)
                    keep(self.first_asked, heard.message.request_id, first_at)
                serves = self.state is not None and self.state.state in (ASSIGNED, CHARGING)
                if serves and heard.message.request_id != self.seen.request.value:
                    self.second_at = self.now
            case d.ChargerRequest():
                keep(self.elsewhere, heard.message.request_id, self.now)
                return False
            case d.ChargerCancel(charger_name=self.name):
                self._cancel(heard.message.request_id)
            case _:
                return False
        return True

    def forget(self) -> None:
        """After a silence, treat every cancel as perhaps not received. Forget the cancel of an
        unrequested charge."""
        self.cancels.pop(UNREQUESTED + self.name, None)
        self.cancels = dict.fromkeys(self.cancels, LOST)

    def settle(self, state: d.ChargerState) -> None:
        """Note the time if the station shows another state or request than before. Forget the cancel of
        an unrequested charge that has ended."""
        if self.before is None or _served(self.before) != _served(state):
            self.same_before, self.same_since = self.same_since, self.now
        if self.before is None or self.before.request_id != state.request_id:
            self.second_at = NOT_YET
        if state.state in (IDLE, RELEASED):
            self.cancels.pop(UNREQUESTED + self.name, None)

    def _cancel(self, request_id: str) -> None:
        shown = self.state is not None and request_id == self.state.request_id
        ended = self.before is not None and request_id == self.before.request_id
        ended = ended and not unrequested(request_id)  # the state may arrive before its cancel
        if shown or ended or request_id in self.requests:  # or the cancel before its request
            keep(self.cancels, request_id, min(self.cancels.get(request_id, LOST), self.now))
        if self.state is not None and not shown:
            self.foreign_at = self.now


def unrequested(request_id: str) -> bool:
    """Return whether this is the id of a charge that nobody requested."""
    return request_id.startswith(UNREQUESTED)


def _served(state: d.ChargerState) -> tuple[int, str]:
    return state.state, state.request_id
