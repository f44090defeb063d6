"""`python -m tests.workbench.troubles [NAME …]`: the twelve troubles with real processes on loopback.

A table at the end shows two results for each trouble: `explain` from the live graph, and from the file.
The exit code is 1 if any printed text differs from the expected text.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from hal_fakes.domain import domain_for_a_while
from tests.workbench.troubles import chargers, doors, lifts
from tests.workbench.troubles.site import CHARGER, DOOR, KINDS, LIFT, OTHER_LIFT
from tests.workbench.troubles.verdicts import VERDICTS, wrong
from tests.workbench.troubles.wire import LEASE_S, WireSite

Stage = Callable[[Any], Any]


@dataclass(frozen=True)
class Real:
    """One trouble with real processes.

    - `stage` brings about the trouble, with the daemons in `serves`.
    - `daemon`: the daemon whose file `explain` reads; "" for the device's own daemon.
    - `then` runs after `explain --live`, and before the recorder writes the file.
    - `dead`: whether `explain` waits until DDS has noticed that a node was killed.
    - `slow` names a part of the device that is always slow.
    """

    stage: Stage
    kind: str = "lift"
    serves: tuple[str, ...] = (LIFT,)
    daemon: str = ""
    then: Stage | None = None
    dead: bool = False
    slow: str = ""


TROUBLES: Final = {
    "robot_dies_in_car": Real(lifts.robot_dies_in_car, dead=True),
    "fire_mid_ride": Real(lifts.fire_mid_ride, then=lifts.robot_leaves, slow="car"),
    "lift_door_contact_cut": Real(lifts.lift_door_contact_cut, dead=True),
    "door_end_contact_cut": Real(doors.open_contact_cut, "door", (DOOR,), dead=True),
    "supervisor_killed": Real(lifts.supervisor_killed, dead=True),
    "supervisor_killed_b": Real(lifts.supervisor_killed_b, dead=True),
    "slow_modbus_unit": Real(lifts.slow_modbus_unit),
    "two_daemons_one_name": Real(lifts.two_daemons_one_name),
    "two_foreign_nodes": Real(
        lifts.two_foreign_nodes, serves=(LIFT, OTHER_LIFT), daemon=lifts.SUPERVISOR
    ),
    "robot_clock_hour_off": Real(lifts.robot_clock_hour_off),
    "daemon_killed": Real(lifts.daemon_killed, serves=(LIFT, OTHER_LIFT), dead=True),
    "robot_never_reaches_charger": Real(chargers.robot_never_comes, "charger", (CHARGER,)),
    "fleet_adapter_killed": Real(lifts.fleet_adapter_killed, dead=True),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Play the named troubles, or all troubles without a name."""
    parser = argparse.ArgumentParser(prog="python -m tests.workbench.troubles", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", choices=[*TROUBLES, []])
    parser.add_argument("--screens", action="store_true", help="print each screen that is wrong")
    options = parser.parse_args(argv)
    rows = [("name", "live", "file")]
    for name in options.names or TROUBLES:
        rows.append((name, *_played(name, TROUBLES[name], screens=options.screens)))
        _print(" · ".join(rows[-1]))
    _print("", *(f"{name:30} {live:12} {file}" for name, live, file in rows))
    return int(any("wrong" in row for row in rows))


def _played(name: str, trouble: Real, *, screens: bool) -> tuple[str, str]:
    device = KINDS[trouble.kind]
    with domain_for_a_while() as domain, tempfile.TemporaryDirectory() as folder:
        site = WireSite(Path(folder), domain, trouble.serves)
        try:
            if trouble.slow:
                site.fail(device, trouble.slow, "slow")
            names = trouble.stage(site) or {}
            site.waits(LEASE_S if trouble.dead else 0.0)
            live = _judged(name, "live", trouble, site.live(device), names, screens=screens)
            if trouble.then:
                trouble.then(site)
            told = site.file(device, trouble.daemon)
            return live, _judged(name, "file", trouble, told, names, screens=screens)
        finally:
            site.close()


def _judged(
    name: str, view: str, trouble: Real, screen: str, names: dict[str, str], *, screens: bool
) -> str:
    verdict = next((v for v in VERDICTS if v.key == (name, view, trouble.kind)), None)
    if verdict is None:
        return "no verdict"
    found = wrong(verdict, screen, names)
    if found and screens:
        _print(f"--- {name}, {view}", *found, "", screen)
    return "wrong" if found else "right"


def _print(*told: str) -> None:
    sys.stdout.write("\n".join(told) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
