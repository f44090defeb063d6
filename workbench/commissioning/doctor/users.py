"""Find the daemon's user, and this user's access to devices.

If the unit is installed, the user is the service's user, with the groups from the service's drop-ins.
Otherwise the user is the present user. The doctor reads users and groups from /etc/passwd and
/etc/group.
"""

import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from bridges.system.directories import GROUPS, SERVICE_USER, user_of
from workbench.commissioning.doctor.finding import Finding, note, ok, wrong
from workbench.commissioning.doctor.machine import Machine

UNITS: Final = ("/etc/systemd/system", "/usr/lib/systemd/system", "/lib/systemd/system")
UNIT: Final = "rmf-bridge@.service"


@dataclass(frozen=True, slots=True)
class User:
    """The user who opens the devices. `service` tells whether systemd's unit starts the daemon."""

    name: str
    uid: int
    gids: frozenset[int]
    service: bool

    def may(self, found: os.stat_result) -> bool:
        """Return whether the file's mode lets this user read and write the file. Access lists are
        ignored."""
        if self.uid == 0:
            return True
        if found.st_uid == self.uid:
            wanted = stat.S_IRUSR | stat.S_IWUSR
        elif found.st_gid in self.gids:
            wanted = stat.S_IRGRP | stat.S_IWGRP
        else:
            wanted = stat.S_IROTH | stat.S_IWOTH
        return found.st_mode & wanted == wanted


def has_unit(machine: Machine) -> bool:
    """Return whether the unit of rmf-bridges is installed."""
    return any(machine.at(f"{place}/{UNIT}").exists() for place in UNITS)


def user(machine: Machine, service: str) -> User:
    """Return the daemon's user. If `rmf-bridge enable` has made a user for this service, return that
    user. Otherwise return the user that the unit names."""
    if not has_unit(machine):
        return User(_name(machine, machine.uid), machine.uid, machine.gids, service=False)
    name = user_of(service) if user_of(service) in _passwd(machine) else SERVICE_USER
    ids = _passwd(machine).get(name, (-1, -1))
    groups = _groups(machine)
    gids = {gid for group, (gid, members) in groups.items() if group in GROUPS or name in members}
    return User(name, ids[0], frozenset({ids[1], *gids}), service=True)


def users(machine: Machine, who: User) -> Iterator[Finding]:
    """Examine whether the unit's user and the groups for devices exist."""
    subject = "user"
    if not who.service:
        yield note(
            subject,
            f"the unit {UNIT} is not installed; the findings below are for {who.name}",
            "the daemon does not start at boot, and nobody restarts the daemon",
            "docs/how-to/install.md",
        )
        return
    if SERVICE_USER not in _passwd(machine):
        yield wrong(
            subject,
            f"there is no user {SERVICE_USER}, whom the unit names",
            "systemd cannot start the service (status=217/USER)",
            f"sudo useradd --system --no-create-home {SERVICE_USER}",
        )
    missing = [group for group in GROUPS if group not in _groups(machine)]
    if missing:
        yield wrong(
            subject,
            f"there is no group {' and no group '.join(missing)}, which a service may need",
            "`rmf-bridge enable` cannot put the daemon into the group, so the daemon cannot open its"
            " devices",
            "; ".join(f"sudo groupadd --system {group}" for group in missing)
            + "; then sudo rmf-bridge enable FILE",
        )
    if not missing and SERVICE_USER in _passwd(machine):
        yield ok(subject, f"the service runs as {who.name}, in the groups {', '.join(GROUPS)}")


def join(who: User, group: str) -> str:
    """Return the remedy that adds this user to a group."""
    if who.service:
        return f"sudo rmf-bridge enable FILE: its drop-in gives the service the group {group}"
    return f"sudo usermod -aG {group} {who.name}, then log in again"


def group_of(machine: Machine, gid: int) -> str:
    """Return a group's name. Return the group's number if the group has no name."""
    return next((n for n, (found, _) in _groups(machine).items() if found == gid), str(gid))


def _name(machine: Machine, uid: int) -> str:
    return next((n for n, (found, _) in _passwd(machine).items() if found == uid), f"uid {uid}")


def _rows(machine: Machine, path: str) -> Iterator[list[str]]:
    for line in (machine.text(path) or "").splitlines():
        row = line.split(":")
        if len(row) >= 4 and row[2].isdecimal():
            yield row


def _passwd(machine: Machine) -> dict[str, tuple[int, int]]:
    rows = _rows(machine, "/etc/passwd")
    return {row[0]: (int(row[2]), int(row[3])) for row in rows if row[3].isdecimal()}


def _groups(machine: Machine) -> dict[str, tuple[int, list[str]]]:
    return {row[0]: (int(row[2]), row[3].split(",")) for row in _rows(machine, "/etc/group")}
