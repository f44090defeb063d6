"""A service's drop-in. All services share one systemd unit, and the drop-in adds the settings for one
service's YAML.

`rmf-bridge enable` writes the drop-in. The unit alone permits access to no device. `run` refuses to
start if the drop-in was written for other needs than the YAML's: a daemon that may not open its relay
could only report this each second.
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
"""The environment variable in which the drop-in gives the result of `fits`. The unit itself sets it to
`nothing`."""
ROUND_S: Final = 1.25
LEAST_S: Final = 3.0
WITHOUT_OUTPUTS_S: Final = 10.0
LOCAL: Final = ("localhost", "multicast")


def text(config: Config, groups: Collection[str]) -> str:
    """Return the drop-in's text. `groups`: the machine's groups. The text names no other group, because
    a unit with an unknown group does not start."""
    head = (
        f"# Written by `rmf-bridge enable` for {config.path.name}. After a change enable it again."
    )
    service = [f"Environment={FITS}={fits(config)}", *_service(config, groups)]
    return "\n".join([head, *_unit(config), "[Service]", *service, ""])


def fits(config: Config) -> str:
    """Return a hash of this file's needs. Equal needs have equal hashes."""
    needs = "\n".join([*_unit(config), *_service(config, GROUPS)])
    return hashlib.sha256(needs.encode()).hexdigest()[:16]


def misfit(config: Config, environ: Mapping[str, str]) -> str:
    """Return the error if our unit has no drop-in for this file's needs; "" if the drop-in fits."""
    met = environ.get(FITS, "")
    if met in ("", fits(config)):  # "": no unit of ours started this process
        return ""
    why = "has no drop-in" if met == "nothing" else "has a drop-in for other buses or durations"
    return f"{config.path}: the unit {why}: run `sudo rmf-bridge enable {config.path}`"


def watchdog_s(config: Config) -> float:
    """Return the longest time (s) for which a daemon that hangs keeps its relays on.

    A loop finishes a step each second, when its states are due, or one bus call later. A bus call may
    take at most half of this time. For a daemon without outputs the time is longer, because a slow disk
    may delay a step.
    """
    slowest = max((getattr(bus, "timeout_s", 0.0) for bus in config.buses.values()), default=0.0)
    return max(LEAST_S, 1.75 * slowest + ROUND_S) if config.buses else WITHOUT_OUTPUTS_S


def _unit(config: Config) -> list[str]:
    """Return the lines that load kernel modules before the unit starts. DeviceAllow permits a device
    class only after its module is loaded."""
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
    """Return each word once, without empty words."""
    return list(dict.fromkeys(word for words in found for word in words if word))


def _hosts(rmf: Rmf, needs: Iterable[Needs]) -> list[str] | None:
    """Return the addresses that the daemon talks to. Return None if an address is unknown before the
    daemon runs.

    Unknown are the nodes of a DDS site, the peers of a zenoh peer, and the addresses of host names.
    """
    hosts = [*_graph_hosts(rmf), *_each([n.host] for n in needs)]
    return None if not all(map(_is_address, hosts)) else _each([LOCAL, hosts])


def _graph_hosts(rmf: Rmf) -> list[str]:
    """Return the hosts of the other nodes. A host name or "*" means any address."""
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
