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
        tells("""the lifts that the supervisor serves. Messages about other lifts are refused. When
        absent, the supervisor serves every lift that it hears of, as RMF's supervisor does."""),
    ] = None
    quiet_start_s: Annotated[
        QuietStart,
        tells("""how long the supervisor only listens after its start, so that a restart ends no
        ride. The supervisor also waits this long before it ends a session that a lift shows and no
        robot requests."""),
    ] = 3.0
    silent_after_s: Annotated[
        Patience,
        tells("""how long a waiting session may be without a request; after that it leaves the queue.
        Fleet adapters repeat their requests at every LiftState."""),
    ] = 10.0
    holder_alarm_s: Annotated[
        Patience,
        tells("""how long the session that has its turn (the holder) may be silent before a fault
        is shown."""),
    ] = 60.0
    holder_ttl_s: Annotated[
        Patience | None,
        tells("""how long the holder may be silent before its session is ended. When absent, the
        session is never ended, because its robot may be in the car."""),
    ] = None
    clock_synchronised: Annotated[
        bool,
        tells("""whether this machine's clock and the fleet adapters' clocks agree (NTP). If they
        agree, the supervisor can reject a request because of its age. Otherwise it only compares
        the stamps of the same requester."""),
    ] = False
    max_request_age_s: Annotated[
        Seconds,
        tells("""with `clock_synchronised`: the greatest age of a request. An older request is
        obeyed only if it is repeated."""),
    ] = 10.0

    def problems(self) -> Remarks:
        """Yield a problem if a session would end before its alarm, or if the list of lifts is empty."""
        if self.holder_ttl_s is not None and self.holder_ttl_s <= self.holder_alarm_s:
            least = f"{self.holder_alarm_s:g} s"
            text = f"must be more than holder_alarm_s ({least}), so that the alarm comes first"
            yield ("holder_ttl_s",), text
        if self.lifts == []:
            yield ("lifts",), "is empty: name the lifts, or delete the key to serve every lift"


def speaks_of(settings: LiftSupervisorSettings) -> Iterable[Place]:
    """Yield the lifts that the supervisor serves."""
    for i, name in enumerate(settings.lifts or ()):
        yield ("lifts", str(i)), "lift", name
