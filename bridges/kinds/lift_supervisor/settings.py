"""The lift supervisor's section of its YAML."""

from collections.abc import Iterable
from typing import Annotated

from bridges.kinds.shared.fields import GraphSettings, Name, Patience, QuietStart, Seconds, tells
from bridges.kinds.shared.kind import Place
from bridges.kinds.shared.remarks import Remarks


class LiftSupervisorSettings(GraphSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The lift supervisor's policy."""

    lifts: Annotated[
        list[Name] | None,
        tells("""the lifts that the supervisor serves; messages about other lifts are refused. When
        absent, it serves every lift that it hears of, as RMF's supervisor does."""),
    ] = None
    quiet_start_s: Annotated[
        QuietStart,
        tells("""how long the supervisor only listens after its start, so that a restart ends no
        ride. This is also how long a lift may show a session that no robot requests, before that
        session is ended."""),
    ] = 3.0
    silent_after_s: Annotated[
        Patience,
        tells("""after so long without a request a waiting session leaves the queue. Fleet adapters
        repeat their requests at every LiftState."""),
    ] = 10.0
    holder_alarm_s: Annotated[
        Patience, tells("how long the holder may be silent before a fault is shown.")
    ] = 60.0
    holder_ttl_s: Annotated[
        Patience | None,
        tells("""how long the holder may be silent before its session is ended. When absent, the
        session is never ended, as its robot may be in the car."""),
    ] = None
    clock_synchronised: Annotated[
        bool,
        tells("""this clock and the fleet adapters' clocks agree (NTP), so that the age of a request
        can be judged. Otherwise only the stamps of one requester are compared."""),
    ] = False
    max_request_age_s: Annotated[
        Seconds,
        tells(
            "with `clock_synchronised`, a request older than this counts only if it is repeated."
        ),
    ] = 10.0

    def problems(self) -> Remarks:
        """Yield an alarm that would come after the end of its session, or an empty list of lifts."""
        if self.holder_ttl_s is not None and self.holder_ttl_s <= self.holder_alarm_s:
            text = f"must be more than 'holder_alarm_s' ({self.holder_alarm_s:g} s): alarm first"
            yield ("holder_ttl_s",), text
        if self.lifts == []:
            yield ("lifts",), "is empty: name the lifts, or leave it out to serve every lift"


def speaks_of(settings: LiftSupervisorSettings) -> Iterable[Place]:
    """Yield the lifts to be served."""
    for i, name in enumerate(settings.lifts or ()):
        yield ("lifts", str(i)), "lift", name
