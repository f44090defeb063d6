"""The drop-in of a service. All services share one systemd unit, and a drop-in adds the settings for
one service's YAML.

`rmf-bridge enable` writes the drop-in. Without a drop-in the unit permits access to no device. If the
drop-in does not fit the needs of the YAML, `run` refuses to start. Otherwise the daemon would start,
but could not open its relay.
"""

import hashlib
import ipaddress
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Final

from bridges.kinds.shared.rmf_section import Rmf, Zenoh
from bridges.settings.config import Config
from bridges.system.directories import GROUPS
from bridges.transports.zenoh.config import mode
from drivers.hal import Needs

FITS: Final = "RMF_BRIDGE_FITS"
"""The environment variable in which the drop-in tells the daemon the hash from `fits`. In a unit
without a drop-in, its value is `nothing`."""
ROUND_S: Final = 1.25
LEAST_S: Final = 3.0
WITHOUT_OUTPUTS_S: Final = 10.0
JOINS_RMF_S: Final = 3.0
"""The time (s) that RMF's adapter may take to join RMF. Meanwhile it stops every thread of the
process (rmf_ros2, adapter.cpp: `make` keeps Python's global lock)."""
LOCAL: Final = ("localhost", "multicast")


def text(config: Config, groups: Collection[str], user: str = "") -> str:
    """Return the drop-in's text. `groups`: the machine's groups. `user`: the service's own user; "" for
    the unit's user.

    A unit with an unknown user or group does not start, so the text names only groups of this machine.
    The user is not one of the needs in `fits`, so a drop-in of an older version still fits.
    """
    head = (
        f"# Written by `rmf-bridge enable` for {config.path.name}. If it changes, enable it again."
    )
    service = [f"Environment={FITS}={fits(config)}", *_service(config, groups)]
    service = [f"User={user}", *service] if user else service
    return "\n".join([head, *_unit(config), "[Service]", *service, ""])


def fits(config: Config) -> str:
    """Return a hash of the buses, groups and durations that the file needs. Files with equal needs have
    equal hashes."""
    needs = "\n".join([*_unit(config), *_service(config, GROUPS)])
    return hashlib.sha256(needs.encode()).hexdigest()[:16]


def misfit(config: Config, environ: Mapping[str, str]) -> str:
    """Return an error text if the drop-in of our unit is missing or does not fit this file's needs.
    Return "" if the drop-in fits."""
    met = environ.get(FITS, "")
    if met in ("", fits(config)):  # "": our unit did not start this process
        return ""
    why = "has no drop-in" if met == "nothing" else "has a drop-in for other buses or durations"
    return f"{config.path}: the unit {why}: run `sudo rmf-bridge enable {config.path}`"


def watchdog_s(config: Config) -> float:
    """Return systemd's watchdog time (s). A daemon that hangs keeps its relays on for at most this
    time.

    A loop finishes a step at least each second, because it publishes states each second. One bus call
    may delay the step by at most half of the watchdog time. A daemon without outputs gets a longer
    time, because a slow disk may delay a step. So does a fleet's daemon, which stands still while it
    joins RMF.
    """
    slowest = max((getattr(bus, "timeout_s", 0.0) for bus in config.buses.values()), default=0.0)
    if not config.buses:
        return WITHOUT_OUTPUTS_S
    joins_s = JOINS_RMF_S if config.kind == "fleet" else 0.0
    return max(LEAST_S, 1.75 * slowest + ROUND_S) + joins_s


def _unit(config: Config) -> list[str]:
    """Return the lines that load kernel modules before the unit starts. DeviceAllow works for a class
    of devices only after the class's module is loaded."""
    units = " ".join(
        f"modprobe@{name}.service" for name in _each(n.modules for n in _needs(config))
    )
    return ["[Unit]", f"Wants={units}", f"After={units}"] if units else []


def _service(config: Config, groups: Collection[str]) -> Iterator[str]:
    needs = _needs(config)
    yield f"WatchdogSec={watchdog_s(config):g}"
    devices = _each(n.devices for n in needs)
    yield from (f"DeviceAllow={device} rw" for device in devices)
    if not devices:
        yield "PrivateDevices=yes"
    yield from (f"SupplementaryGroups={n}" for n in _each([n.group] for n in needs) if n in groups)
    yield from (f"RestrictAddressFamilies={name}" for name in _each([n.family] for n in needs))
    hosts = _hosts(config.rmf, needs)
    if hosts is not None:
        yield "IPAddressDeny=any"
        yield f"IPAddressAllow={' '.join(hosts)}"


def _needs(config: Config) -> list[Needs]:
    return [config.bus_type(name).needs(bus) for name, bus in config.buses.items()]


def _each(found: Iterable[Iterable[str]]) -> list[str]:
    """Return all words without repetitions and without empty words."""
    return list(dict.fromkeys(word for words in found for word in words if word))


def _hosts(rmf: Rmf, needs: Iterable[Needs]) -> list[str] | None:
    """Return the addresses that the daemon talks to. Return None if at least one address cannot be
    known in advance.

    These addresses cannot be known: the nodes of a DDS site, the peers of a zenoh peer, and host names.
    """
    hosts = [*_graph_hosts(rmf), *_each([n.host] for n in needs)]
    return None if not all(map(_is_address, hosts)) else _each([LOCAL, hosts])


def _graph_hosts(rmf: Rmf) -> list[str]:
    """Return the hosts of the other nodes. A host name or "*" in the result means any address."""
    if rmf.network == "localhost":
        return []
    zenoh = rmf.zenoh or Zenoh()
    if rmf.transport != "zenoh" or mode(zenoh) == "peer":
        return ["*"]
    ends = (end.partition("/")[2].rpartition(":")[0] for end in zenoh.connect)
    return [end.strip("[]") for end in ends if end != "localhost"]


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True
