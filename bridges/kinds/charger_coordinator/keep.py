"""The part of the memory that is saved to disk for a restart: the queue, each station's robot, the
robots' failures, and the percentages of the schedule that they have reached.

Each robot's last place is saved too, because its fleet may be silent after the restart. Other states of
robots and stations are not saved, because new states arrive within a second. A request may
have been sent but not saved. In that case the station's state still shows the request's id, and the
coordinator recognises that id.
"""

from collections.abc import Mapping
from typing import Annotated, Final

import msgspec
from msgspec import Meta

from bridges.kinds.charger.settings import RobotName, robot
from bridges.kinds.charger_coordinator.memory import By, Grant, SiteMemory, Wish
from bridges.kinds.charger_coordinator.schedule import Target
from bridges.kinds.charger_coordinator.settings import CoordinatorSettings
from bridges.kinds.shared import keep
from bridges.kinds.shared.keep import Text

VERSION: Final = 1
SITE: Final = "site"


class WishRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A `Wish` as it is saved. `robot` is FLEET/ROBOT, as everywhere in this file."""

    robot: Text
    by: By
    task_id: str
    station: str
    request_id: str
    start_timeout_s: Annotated[float, Meta(ge=0, le=86400)]
    called: bool = False


class GrantRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A `Grant` as it is saved, without the facts that the station's next state shows."""

    robot: Text
    request_id: str
    start_timeout_s: Annotated[float, Meta(ge=0, le=86400)]
    started: bool
    over: bool


class KeptCoordinator(keep.Kept, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """The parts of SiteMemory that are saved to disk."""

    count: Annotated[int, Meta(ge=0)]
    wishes: list[WishRecord]
    grants: dict[Text, GrantRecord]
    strikes: dict[Text, list[Text]]
    served: dict[Text, str]
    over: list[str]
    preferred: dict[Text, Text]
    stood: dict[Text, Text] = msgspec.field(default_factory=dict)
    reached: dict[Text, Target] = msgspec.field(default_factory=dict)


def persist(memories: Mapping[str, SiteMemory]) -> bytes:
    """Encode the memory for the next start. The bytes change only when a part that is saved changes."""
    memory = memories.get(SITE, SiteMemory())
    record = KeptCoordinator(
        VERSION,
        memory.count,
        [_wish(wish) for wish in memory.wishes],
        {name: _grant(grant) for name, grant in sorted(memory.grants.items())},
        {str(who): list(where) for who, where in sorted(memory.strikes.items())},
        {str(who): task for who, task in sorted(memory.served.items())},
        list(memory.over),
        {str(who): station for who, station in sorted(memory.preferred.items()) if station},
        {str(who): place for who, place in sorted(memory.places.items()) if place},
        {str(who): percent for who, percent in sorted(memory.reached.items())},
    )
    return msgspec.json.encode(record)


def _wish(w: Wish) -> WishRecord:
    return WishRecord(
        str(w.robot), w.by, w.task_id, w.station, w.request_id, w.start_timeout_s, w.called
    )


def _grant(g: Grant) -> GrantRecord:
    return GrantRecord(str(g.robot), g.request_id, g.start_timeout_s, g.started, g.over)


def restore(kept: bytes, settings: CoordinatorSettings, now: float) -> dict[str, SiteMemory]:
    """Make the memory at start, for the robots and stations that are still in the YAML.

    Raises ValueError for bytes that `persist` did not make. The coordinator's timeouts start again at
    `now`.
    """
    found = keep.read(kept, KeptCoordinator, VERSION, "a coordinator's memory")
    return {SITE: _memory(found, settings, now)}


def _memory(found: KeptCoordinator, settings: CoordinatorSettings, now: float) -> SiteMemory:
    known, stations = settings.robots(), settings.stations

    def ours(text: str) -> RobotName | None:
        who = robot(text)
        return who if who in known else None

    wishes: dict[RobotName, Wish] = {}
    for w in found.wishes:
        if who := ours(w.robot):
            wish = Wish(who, w.by, w.task_id, w.called, w.station, w.request_id, w.start_timeout_s)
            wishes.setdefault(who, wish)
    grants = {
        name: Grant(who, g.request_id, now, g.start_timeout_s, started=g.started, over=g.over)
        for name, g in found.grants.items()
        if name in stations and (who := ours(g.robot))
    }
    return SiteMemory(
        began_at=now,
        wishes=tuple(wishes.values()),
        grants=grants,
        strikes={who: tuple(at) for text, at in found.strikes.items() if (who := ours(text))},
        served={who: task for text, task in found.served.items() if (who := ours(text))},
        reached={who: percent for text, percent in found.reached.items() if (who := ours(text))},
        over=tuple(found.over),
        count=found.count,
        preferred={who: s for text, s in found.preferred.items() if (who := ours(text))},
        stood={who: place for text, place in found.stood.items() if (who := ours(text))},
    )
