"""The contacts of a lift behind a gateway: one for each floor, two for a door, one for each hazard.

These contacts can be cut, as our wires can.
"""

from collections.abc import Callable, Collection, Iterable
from itertools import count

import msgspec

from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import Hazard
from drivers.lift.dry_contact import DryContactLiftSettings


def behind(
    settings: LiftSettings,
    shows: Callable[[str], bool],
    doors: Iterable[str],
    motions: Collection[str],
    held: Iterable[str],
    at: str = "",
    only_in_agv_mode: Collection[str] = (),
) -> DryContactLiftSettings:
    """Return the wiring of this lift.

    `shows`: does the gateway report this hazard, or AGV mode? `motions`: the states of motion that it
    reports. `held`: its commands besides calls. `at`: the beginning of every point. `only_in_agv_mode`:
    the parts that are valid only then.
    """
    inputs, coils = count(), count()

    def line(part: str = "", active: str = "high") -> dict[str, str]:
        when = {"valid_when": "agv_mode"} if part in only_in_agv_mode else {}
        return {"point": f"{at}discrete input {next(inputs)}", "active": active, **when}

    def coil() -> dict[str, str]:
        return {"point": f"{at}coil {next(coils)}", "active": "high"}

    wired = {h.value: line(h.value, "low") for h in Hazard if shows(h)}
    if shows("agv_mode"):
        wired["agv_mode"] = line()
    for door in doors:
        wired |= {f"{door}_{end}": line(door) for end in ("opened", "closed")}
    if motions:
        moves = ("moving",) if "moving" in motions else ("up", "down")
        wired |= {name: line("motion") for name in moves}
    levels = settings.levels()
    plain = {
        **{n: getattr(settings, n) for n in LiftSettings.__struct_fields__},
        "accept_unsafe": {},
        "inputs": wired,
        "floor_code": {"encoding": "one_hot", "lines": {level: line("floor") for level in levels}},
        "outputs": {name: coil() for name in held},
        "calls": {level: coil() for level in levels},
    }
    return msgspec.convert(msgspec.to_builtins(plain), DryContactLiftSettings)
