"""The requesters of a device: their wishes, the start of each wish, and their present actions."""

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass

from bridges.messages.definitions import Time
from bridges.messages.stamps import in_seconds
from bridges.observe.limits import GIVEN_UP_S, MOST_REQUESTERS, REPEATS_S, REQUESTER_SILENT_S


@dataclass(frozen=True, slots=True)
class Moment:
    """The time at which something begins.

    - `at`: seconds on the clock of `Heard.at`
    - `wall`: seconds since the epoch
    - `seen`: False if it began before we started to listen
    """

    at: float
    wall: float
    seen: bool = True


@dataclass(slots=True)
class Fact:
    """A present value. `since`: the time when this value began."""

    value: str
    since: Moment

    def say(self, value: str, moment: Moment) -> bool:
        """Set the present value. Return True if the value changes."""
        if value == self.value:
            return False
        self.value, self.since = value, moment
        return True


@dataclass(slots=True)
class DeviceRequester:
    """One requester of a device, and its wish. `wants`: a floor, a door's mode, or the like.

    A requester's visit lasts from its first request to its END, which is the request that gives the
    device back.

    The times of requests:

    - `first`: the first request of the visit
    - `since`: the first request for the present wish
    - `last`: the requester's last request
    - `passed_on`: the supervisor's last request for this requester
    - `ended`: the first END
    - `end_last`: the latest END

    The times of effects:

    - `lacks`: the time since which the wish is unfulfilled
    - `met`: the time when RMF saw the present wish fulfilled
    - `boarded`: the first time at which RMF saw any wish of this visit fulfilled. `boarded_at` is that
      wish.
    - `granted`: the time when the requester got the device

    Other facts:

    - `reached`: the last fulfilled wish
    - `given_up`: the wish before the present wish, if it was not fulfilled
    - `end_passed_on`: Has the supervisor sent END to the device?
    - `human`: Does the present wish ask for a lift's HUMAN mode?
    - `stands_s`: the time (s) for which a request for a charger stands, although nobody repeats it
    - `gone`: Has the requester stopped asking without END?
    - `times`: the number of requests
    - `own`: Was a message of the requester itself heard, and not only the supervisor's messages?
    - `stamp_age_s`: the age (s) of the last request by our clock. It is valid only if that request was
      `stamped`.
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
    human: bool = False
    stands_s: float = 0.0
    gone: bool = False
    stamped: bool = False
    stamp_age_s: float = 0.0

    def asks(self, now: Moment) -> bool:
        """Return whether the requester still repeats its request, or its request still stands."""
        lasts_s = max(self.stands_s, REQUESTER_SILENT_S)
        return self.ended is None and now.at - self.last.at <= lasts_s

    def ends(self, now: Moment) -> bool:
        """Return whether the requester still repeats END."""
        return self.end_last is not None and now.at - self.end_last.at <= REQUESTER_SILENT_S

    def stamp(self, moment: Moment, stamp: Time) -> None:
        """Note the age of the requester's last request by our clock."""
        self.stamped = stamp != Time()
        self.stamp_age_s = moment.wall - in_seconds(stamp)


class DeviceRequesters:
    """All requesters of one device. If too many names come, the requester that was silent longest is
    dropped.

    `began`: the time when we began to listen.
    """

    def __init__(self, began: Moment) -> None:
        self._began = began
        self._all: OrderedDict[str, DeviceRequester] = OrderedDict()

    def __iter__(self) -> Iterator[DeviceRequester]:
        return iter([*self._all.values()])

    def get(self, who: str) -> DeviceRequester | None:
        """Return this requester. Return None if its visit is over."""
        return self._all.get(who)

    def ask(
        self, who: str, wants: str, moment: Moment, keep: str = "", *, stands: bool = False
    ) -> tuple[DeviceRequester, bool]:
        """Note a request. Return the requester, and whether the wish is new.

        `keep`: the name of a requester that must not be dropped. `stands`: Does the device send no
        states, so that nobody repeats a request?
        """
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
        """Forget this requester."""
        self._all.pop(who, None)
