"""The lift supervisor's section of its YAML."""

from collections.abc import Iterable

from bridges.core.fields import GraphSettings, Name, Patience, Seconds
from bridges.core.kind import Place


class Settings(GraphSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the lift supervisor may decide by itself.

    `lifts`: the lifts that it serves, whatever names anybody makes up; every lift that it hears of when
    absent, as RMF's own does.
    `quiet_start_s`: how long it only listens, so that a restart ends no ride; and how long a session
    must be shown by a lift, with nobody asking for it, before it is ended.
    `silent_after_s`: a requester without the lift that has been silent for so long has gone; fleet
    adapters repeat themselves at every LiftState.
    `holder_alarm_s`: a fault is shown when the holder has been silent for so long.
    `holder_ttl_s`: then the session is ended. Off when absent: the robot may be in the car.
    `clock_synchronised`: this clock and the fleet adapters' agree (NTP); only then is a request's age
    judged. Without it only the order of each requester's own stamps is.
    `max_request_age_s`: with `clock_synchronised`, older requests count only when repeated.
    """

    lifts: list[Name] | None = None
    silent_after_s: Patience = 10.0
    holder_alarm_s: Patience = 60.0
    holder_ttl_s: Patience | None = None
    clock_synchronised: bool = False
    max_request_age_s: Seconds = 10.0

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """An alarm comes before what it warns of."""
        if self.holder_ttl_s is not None and self.holder_ttl_s <= self.holder_alarm_s:
            text = f"must be more than 'holder_alarm_s' ({self.holder_alarm_s:g} s): alarm first"
            yield ("holder_ttl_s",), text
        if self.lifts == []:
            yield ("lifts",), "is empty: name the lifts, or leave it out to serve every lift"


def speaks_of(settings: Settings) -> Iterable[Place]:
    """The lifts that it is to serve."""
    for i, name in enumerate(settings.lifts or ()):
        yield ("lifts", str(i)), "lift", name
