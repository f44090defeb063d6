"""What the status file and the log say of the site."""

from collections.abc import Iterator
from typing import Any

import msgspec

from bridges.charger_coordinator.diagnosis import UNKNOWN_RECEIVER, Side, on_pad
from bridges.charger_coordinator.memory import Memory, Seen
from bridges.charger_coordinator.settings import Site
from bridges.core.decision import Fault


class SiteReport(msgspec.Struct, frozen=True):
    """`read_at`: when a station was heard last (monotonic s). `stations`: (station, who has it or
    what it shows). `queue`: the robots that wait, in their order."""

    read_at: float | None
    stations: tuple[tuple[str, str], ...] = ()
    queue: tuple[str, ...] = ()
    faults: tuple[Fault, ...] = ()

    def news(self) -> Any:
        """What is worth a line in the log."""
        return self.stations, self.queue


def report(memory: Memory, now: float, site: Site) -> SiteReport:
    """As it is now."""
    queue = [w.robot for w in memory.wishes if memory.station_of(w.robot) is None]
    return SiteReport(
        read_at=max((seen.at for seen in memory.stations.values()), default=None),
        stations=tuple((name, _of(memory, name)) for name in site.places),
        queue=tuple(map(str, queue)),
        faults=tuple(_faults(memory, now, site)),
    )


def _of(memory: Memory, name: str) -> str:
    """`CHARGING fleet/robot`, `IDLE`, or `?` before the first state."""
    seen, grant = memory.stations.get(name), memory.grants.get(name)
    state = "?" if seen is None else seen.state.name.removeprefix("CHARGER_")
    return state if grant is None or grant.over else f"{state} {grant.robot}"


def _faults(memory: Memory, now: float, site: Site) -> Iterator[Fault]:
    for who, stations in memory.strikes.items():
        if memory.faulty(who):
            what = f"{who} failed at {' and at '.join(stations)}: not tried again"
            yield Fault("ROBOT_FAULTY", what)
    for name in site.places:
        if now >= memory.silent_since(name):
            yield Fault("STATION_SILENT", f"{name}: no ChargerState comes")
        elif name in memory.stations:
            yield from _shown(memory, name, memory.stations[name], site)
        if now < memory.shunned.get(name, now):
            yield Fault("REQUEST_NOT_TAKEN", f"{name}: its daemon's log says why")


def _shown(memory: Memory, name: str, seen: Seen, site: Site) -> Iterator[Fault]:
    """By what the station says of itself."""
    if seen.side in (Side.STATION, Side.LOST, Side.UNCLEAR):
        yield Fault("STATION_OUT_OF_SERVICE", f"{name}: {seen.error}")
    if seen.side is not Side.PAD:
        return
    who = on_pad(seen.error, site.robots, dict(site.receivers))
    stranger = seen.error if seen.error.startswith(UNKNOWN_RECEIVER) else "an unknown robot"
    expected = memory.station_of(who) if who else None
    if who is None or expected != name:
        belongs = f"it is expected at {expected}" if expected else "nobody asked for that"
        yield Fault("WRONG_STATION", f"{who or stranger} stands at {name}, {belongs}")
