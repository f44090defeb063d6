"""The requesters of a device: their wishes, the start of each, and their present activity."""

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass

from bridges.messages.definitions import Time
from bridges.messages.stamps import in_seconds
from bridges.observe.limits import GIVEN_UP_S, MOST_REQUESTERS, REPEATS_S, REQUESTER_SILENT_S


@dataclass(frozen=True, slots=True)
class Moment:
    """The beginning of something. `at`: s on `Heard.at`'s clock. `wall`: s since the epoch. `seen`:
    False if it was before the first message.
    """

    at: float
    wall: float
    seen: bool = True


@dataclass(slots=True)
class Fact:
    """A present value and its beginning."""

    value: str
    since: Moment

    def say(self, value: str, moment: Moment) -> bool:
        """Set the present value. Return True for a change."""
        if value == self.value:
            return False
        self.value, self.since = value, moment
        return True


@dataclass(slots=True)
class DeviceRequester:
    """One requester and its wish. `wants`: a floor, a door's mode, and the like. Times: `first`, the
    start of its visit; `since`, its first request for this wish; `lacks`, the start of its wait;
    `last`, its last request; `passed_on`, the supervisor's last request for it; `met`, the wish seen
    fulfilled by RMF; `boarded`, the first such time in this visit,
    for the wish `boarded_at`; `reached`, the last wish so fulfilled; `granted`, its hold of the device;
    `ended`, its first END, and `end_last`, its latest. `end_passed_on`: the supervisor has passed on
    END. `gone`: it has stopped without END. `times`: the number of its requests. `own`: it was heard
    itself, not only through the supervisor. `given_up`: the wish before this one, unless it was met.
    `stamp_age_s`: the age by our clock of its last request, if that was `stamped`.
    """

    who: str
    wants: str
    first: Moment
    since: Moment
    lacks: Moment
    last: Moment
    times: int = 0
    own: bool = False
    passed_on: Moment | None = None
    granted: Moment | None = None
    met: Moment | None = None
    boarded: Moment | None = None
    boarded_at: str = ""
    reached: str = ""
    given_up: str = ""
    ended: Moment | None = None
    end_last: Moment | None = None
    end_passed_on: bool = False
    gone: bool = False
    stamped: bool = False
    stamp_age_s: float = 0.0

    def asks(self, now: Moment) -> bool:
        """Does the requester still ask?"""
        return self.ended is None and now.at - self.last.at <= REQUESTER_SILENT_S

    def ends(self, now: Moment) -> bool:
        """Does the requester still repeat END?"""
        return self.end_last is not None and now.at - self.end_last.at <= REQUESTER_SILENT_S

    def stamp(self, moment: Moment, stamp: Time) -> None:
        """Note the age of its request, by our clock."""
        self.stamped = stamp != Time()
        self.stamp_age_s = moment.wall - in_seconds(stamp)


class DeviceRequesters:
    """All requesters of one device. A flood of names drops the requester silent for the longest time.

    `began`: the time when we began to listen.
    """

    def __init__(self, began: Moment) -> None:
        self._began = began
        self._all: OrderedDict[str, DeviceRequester] = OrderedDict()

    def __iter__(self) -> Iterator[DeviceRequester]:
        return iter([*self._all.values()])

    def get(self, who: str) -> DeviceRequester | None:
        """Find this requester, while its visit lasts."""
        return self._all.get(who)

    def ask(
        self, who: str, wants: str, moment: Moment, keep: str = "", *, stands: bool = False
    ) -> tuple[DeviceRequester, bool]:
        """Take a request. Return the requester, and True for a new wish. `keep`: the requester that
        must stay. `stands`: no states arrive, so nobody repeats a request."""
        found = self._all.get(who)
        if found is not None and not stands and moment.at - found.last.at > GIVEN_UP_S:
            found.ended = found.ended or found.last
        new = found is None or found.ended is not None
        if found is None or found.ended is not None:
            if found is None and len(self._all) >= MOST_REQUESTERS:
                self.drop(next(one for one in self._all if one != keep))
            early = moment.at - self._began.at < REPEATS_S
            since = Moment(moment.at, moment.wall, seen=moment.seen and not early)
            found = self._all[who] = DeviceRequester(who, wants, since, since, since, moment)
        elif new := found.wants != wants:
            found.given_up = "" if found.reached == found.wants else found.wants
            found.wants, found.since, found.lacks, found.met = wants, moment, moment, None
        found.last, found.gone = moment, False
        found.times += 1
        self._all.move_to_end(who)
        return found, new

    def drop(self, who: str) -> None:
        """Forget a requester."""
        self._all.pop(who, None)
