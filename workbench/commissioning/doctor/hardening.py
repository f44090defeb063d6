"""Compare this machine with the points of docs/how-to/harden.md. The doctor only reads.

Each subject is a heading of that page. If this machine cannot show a fact, the finding is `unknown`,
which is neither good nor bad.
"""

import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from bridges.kinds.shared.rmf_section import Rmf, Zenoh
from bridges.runtime.services import numbers
from bridges.settings.config import Config
from bridges.settings.named_files import CERTIFICATES, SECRETS, named_files
from bridges.system.directories import SERVICE_USER, user_of
from bridges.transports.zenoh.config import is_local, mode
from workbench.commissioning.doctor.finding import Finding, note, ok, unknown, warning, wrong
from workbench.commissioning.doctor.machine import Machine

GRAPH: Final = "RMF's graph"
WIRES: Final = "Field wires"
FIREWALL: Final = "Firewall"
ROOT: Final = "Root filesystem"
FILES: Final = "Files"
USERS: Final = "Users"
UPDATES: Final = "Updates"
PAGE: Final = "docs/how-to/harden.md"
ENABLE: Final = "rmf-bridge enable FILE"
ENCRYPTED: Final = ("tls/", "quic/", "https://")
OTHERS_WRITE: Final = stat.S_IWGRP | stat.S_IWOTH
OTHERS_READ: Final = stat.S_IRWXG | stat.S_IRWXO
LOGINS: Final = ("passwordauthentication", "kbdinteractiveauthentication", "permitrootlogin")
"""The settings of sshd that must be `no`. A password can also come by keyboard-interactive."""
LISTENS: Final = {"tcp": "0A", "udp": "07"}
"""Protocol -> a socket state in /proc/net, as a hexadecimal number. A socket in this state is open and
has no peer (include/net/tcp_states.h)."""
LOOPBACK: Final = re.compile("(0{16}FFFF0000)?[0-9A-F]{6}7F|0{24}01000000")
"""Pattern of 127.x.x.x and ::1 in /proc/net. On x86 and arm, /proc/net prints the four bytes of each
word in reverse order."""


def hardening(config: Config, machine: Machine) -> Iterator[Finding]:
    """Yield the findings on every point."""
    service = _service(machine, config.path.stem)
    yield from _graph(config.rmf, machine, service)
    for name, settings in config.buses.items():
        yield _wire(config, name, settings)
    yield _forwarding(machine.text("/proc/sys/net/ipv4/ip_forward"))
    yield _firewall(machine.printed("nft", "list", "ruleset"), machine.uid)
    yield _ports({name: machine.text(f"/proc/net/{name}") for name in _tables()})
    yield _root(machine.text("/proc/mounts"))
    yield from _files(config, machine)
    yield _runs_as(service, user_of(config.path.stem))
    yield _logins(machine.printed("sshd", "-T"), machine.at("/usr/sbin/sshd").exists())
    yield _updates(machine.printed("apt-config", "dump", "APT::Periodic::Unattended-Upgrade"))


def _service(machine: Machine, name: str) -> dict[str, str] | None:
    """Return the properties of the file's service. Return None if systemd does not know the service."""
    unit = f"rmf-bridge@{name}.service"
    shown = machine.printed("systemctl", "show", unit, "-p", "LoadState,User,Environment") or ""
    found = dict(line.split("=", 1) for line in shown.splitlines() if "=" in line)
    return found if found.get("LoadState") == "loaded" else None


def _graph(rmf: Rmf, machine: Machine, service: dict[str, str] | None) -> Iterator[Finding]:
    speaks = _speaks(rmf, machine)
    if rmf.network == "localhost":
        yield ok(GRAPH, "this machine alone: network is localhost")
    elif speaks == "zenoh":
        yield from _zenoh(rmf.zenoh)
    elif speaks == "ros2":
        yield _sros(service)
    else:
        found = "DDS without ROS has no authentication: whoever reaches the domain can call a lift"
        do = f"transport zenoh with certificates, SROS 2, or a separate network for RMF: {PAGE}"
        yield warning(GRAPH, found, "a lift or door can be taken by anybody on that network", do)


def _speaks(rmf: Rmf, machine: Machine) -> str:
    """Return the transport. For `auto`, return the first transport that seems to be installed."""
    if rmf.transport != "auto":
        return rmf.transport
    if machine.installed("rclpy") or (rmf.ros_setup and machine.at(rmf.ros_setup).exists()):
        return "ros2"
    return "dds" if machine.installed("cyclonedds") else "zenoh"


def _zenoh(zenoh: Zenoh | None) -> Iterator[Finding]:
    settings = zenoh or Zenoh()
    do = f"certificates for every node, and connect: [tls/…]: {PAGE}"
    heard = settings.listen if mode(settings) == "peer" else ()
    ends = [*settings.connect, *(end for end in heard if not is_local(end))]
    open_ends = [end for end in ends if not end.startswith(ENCRYPTED)]
    if open_ends:
        means = "anybody on the path can read and forge every request, and read any password"
        yield warning(GRAPH, f"not encrypted: {', '.join(open_ends)}", means, do)
    elif not (settings.tls and settings.tls.certificate):
        means = "the router cannot tell this daemon from a stranger"
        yield warning(GRAPH, "encrypted, but the daemon has no certificate", means, do)
    else:
        yield ok(GRAPH, "encrypted, with a certificate of the daemon's own")
    yield unknown(
        GRAPH,
        "the router's access control cannot be seen from here",
        "without it any node with a certificate can call a lift",
        f"compare the router's configuration with {PAGE}",
    )


def _sros(service: dict[str, str] | None) -> Finding:
    do = f"docs/how-to/ros.md, SROS 2; {PAGE}"
    if service is None:
        means = "the environment of the daemon decides about SROS 2"
        return unknown(GRAPH, "no service of this file is installed here", means, do)
    said = dict(word.split("=", 1) for word in service["Environment"].split() if "=" in word)
    enforced = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}
    if all(said.get(key) == value for key, value in enforced.items()):
        return ok(GRAPH, "the service enforces SROS 2")
    means = "whoever reaches the domain can call a lift"
    return warning(GRAPH, "the service does not enforce SROS 2", means, do)


def _wire(config: Config, name: str, settings: Any) -> Finding:
    host = config.bus_type(name).needs(settings).host
    kind, base = config.bus_types[name], getattr(settings, "api_base", "")
    do = f"a separate network for {host}: {PAGE}"
    if not host:
        return ok(WIRES, f"bus '{name}' ({kind}) is at this machine, not on a network")
    if base.startswith(ENCRYPTED):
        return ok(WIRES, f"bus '{name}' is encrypted: {base}")
    if base:
        means = "anybody on the path can read the token, and switch the device"
        return warning(WIRES, f"bus '{name}' is not encrypted: {base}", means, f"https; or {do}")
    means = "anybody who reaches the bus can switch its outputs, whatever the daemon does"
    return unknown(WIRES, f"who else reaches bus '{name}' ({kind} at {host})", means, do)


def _forwarding(said: str | None) -> Finding:
    if said is None:
        return unknown(WIRES, "does this machine forward packets between its networks?")
    if said == "0":
        return ok(WIRES, "this machine forwards no packets between its networks")
    means = "RMF's network may reach the relays through this machine"
    return warning(WIRES, "this machine forwards packets", means, "sysctl net.ipv4.ip_forward=0")


def _firewall(rules: str | None, uid: int) -> Finding:
    if rules is None:
        why = "run doctor with sudo" if uid else "nft is not installed, or fails"
        return unknown(FIREWALL, "the firewall's rules cannot be read", do=why)
    tables = re.split(r"^table (\w+) ", rules, flags=re.M)
    chains = [
        (family, chain.partition("}")[0])
        for family, table in zip(tables[1::2], tables[2::2], strict=True)
        for chain in table.split("hook input")[1:]
    ]
    drops = {family for family, chain in chains if "policy drop" in chain}
    if "inet" in drops or drops >= {"ip", "ip6"}:
        return ok(FIREWALL, "the firewall drops every incoming packet that its rules do not accept")
    means = "every open port is reachable by every machine of the network"
    found = "no input chain has the policy drop" if chains else "nft shows no input chain"
    if drops & {"ip", "ip6"}:
        found = f"only {' and '.join(sorted(drops))} packets are dropped by policy"
    return warning(FIREWALL, found, means, f"the rules of {PAGE}")


def _tables() -> Iterator[str]:
    return (f"{protocol}{six}" for protocol in LISTENS for six in ("", "6"))


def _ports(tables: dict[str, str | None]) -> Finding:
    if all(text is None for text in tables.values()):
        return unknown(FIREWALL, "which ports are open to other machines")
    ports = {
        f"{name.rstrip('6')} {port}" for name, text in tables.items() for port in _open(name, text)
    }
    listed = sorted(ports, key=lambda one: (one[:3], int(one[4:])))
    if not listed:
        return ok(FIREWALL, "no port is open to other machines")
    text = f"open to other machines, if the firewall permits: {', '.join(listed)}"
    return note(FIREWALL, text)


def _open(name: str, text: str | None) -> Iterator[int]:
    for line in (text or "").splitlines()[1:]:
        words = line.split()
        address, _, port = words[1].partition(":")
        if words[3] == LISTENS[name.rstrip("6")] and not LOOPBACK.fullmatch(address):
            yield int(port, 16)


def _root(mounts: str | None) -> Finding:
    roots = [line.split() for line in (mounts or "").splitlines() if line.split()[1:2] == ["/"]]
    if not roots:
        return unknown(ROOT, "how the root filesystem is mounted")
    _, _, kind, options, *_ = roots[-1]
    if kind == "overlay":
        return ok(ROOT, "an overlay: a restart forgets every change")
    if "ro" in options.split(","):
        return ok(ROOT, "read-only")
    means = "an intruder or a power cut can change the system permanently"
    return warning(ROOT, f"writable ({kind})", means, f"an overlay: {PAGE}")


def _files(config: Config, machine: Machine) -> Iterator[Finding]:
    """Examine the modes of the YAML, of the YAML's folder, and of each file that the YAML names. All of
    them must belong to root, but for the secrets and a YAML that others cannot read: `enable` gives
    these to the service's user."""
    file = config.path.absolute()
    secrets, readable = (
        list(dict.fromkeys(Path(file) for _, file in named_files(config, keys)))
        for keys in (SECRETS, CERTIFICATES)
    )
    services_uid = numbers(machine.at("/etc/passwd")).get(user_of(file.stem))
    bad = 0
    for path, forbidden in [
        *((one, OTHERS_WRITE) for one in (file.parent, file, *readable)),
        *((one, OTHERS_READ) for one in secrets),
    ]:
        try:
            found = machine.at(path).stat()
        except OSError as error:
            bad += 1
            yield unknown(
                FILES, f"owner and mode of {path}: {error.strerror}", do="run doctor with sudo"
            )
            continue
        bits, owners = found.st_mode, [machine.root_uid]
        if path == file and not bits & stat.S_IROTH and services_uid is not None:
            owners.append(services_uid)
        if path not in secrets and found.st_uid not in owners:
            bad += 1
            means = f"the user with the number {found.st_uid} can change it"
            yield wrong(FILES, f"{path} does not belong to root", means, f"chown root {path}")
        if bits & forbidden:
            bad += 1
            means = "another user can read it" if path in secrets else "another user can change it"
            right = "600" if path in secrets else "go-w"
            yield wrong(FILES, f"{path} has mode {bits & 0o777:o}", means, f"chmod {right} {path}")
    if not bad:
        yield ok(FILES, "the YAML and its files belong to root, and are closed to other users")


def _runs_as(service: dict[str, str] | None, own: str) -> Finding:
    if service is None:
        return unknown(USERS, "the daemon's user: no service of this file is installed here")
    if (name := service["User"]) == own:
        return ok(USERS, f"the daemon runs as {name}, a user of its own")
    if name == SERVICE_USER:
        shared = "an intruder in one daemon could change the files of all daemons of this user"
        return warning(USERS, f"the daemon shares the user {name}", shared, ENABLE)
    means = "an intruder in the daemon would have this user's rights"
    return wrong(USERS, f"the daemon runs as {name or 'root'}", means, ENABLE)


def _logins(said: str | None, there: bool) -> Finding:
    if said is None and not there:
        return ok(USERS, "nobody logs in over SSH: sshd is not installed")
    if said is None:
        return unknown(USERS, "sshd's settings cannot be read", do="run doctor with sudo")
    settings = dict(line.split(" ", 1) for line in said.lower().splitlines() if " " in line)
    if any(key not in settings for key in LOGINS):
        return unknown(USERS, "sshd does not tell how people log in")
    found = [f"{key} {settings[key]}" for key in LOGINS if settings[key] != "no"]
    if not found:
        return ok(USERS, "people log in with keys, and not as root")
    means = "whoever guesses a password, or has root's key, has this machine"
    return warning(USERS, f"sshd: {', '.join(found)}", means, f"the file of {PAGE}")


def _updates(said: str | None) -> Finding:
    if said is None:
        return unknown(UPDATES, "does apt install security updates by itself?")
    if '"0"' in said or '"' not in said:
        means = "known holes in Debian's packages stay open until a person upgrades"
        do = "docs/how-to/upgrade.md, Unattended upgrades"
        return warning(UPDATES, "no security update is installed by itself", means, do)
    return ok(UPDATES, "apt installs security updates by itself")
