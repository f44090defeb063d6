"""Checks files against each other. It finds points or names that two files use, different ROS domains,
and unknown names.

Files that are checked together belong to one site. They count as files of one machine, unless the user
says that they belong to several machines.
"""

from collections.abc import Iterable, Iterator, Sequence

from msgspec import Struct

from bridges.kinds import kind_called
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.settings.load import Config
from bridges.settings.named_files import SECRETS, named_files
from bridges.yaml.parsing import Problem, YamlFile, compose
from bridges.yaml.positions import Spot, locate
from bridges.yaml.spelling import unknown
from drivers.hal import Where

Path = tuple[str, ...]


class Found(Struct, frozen=True):
    """The errors and warnings, in the order of the files."""

    errors: list[Problem]
    warnings: list[Problem]


class ExclusiveUse(Struct, frozen=True):
    """A use of hardware or of a name. Only one file may use such a thing.

    `what`: the name of the thing. `path`: the path of the YAML key that uses it.
    """

    config: Config
    what: str
    path: Path

    def place(self) -> Problem:
        """Return the place in the file as a Problem without text."""
        page = YamlFile(str(self.config.path))
        root = compose(page, self.config.text)
        return page.problem(locate(Spot(root, root, ""), self.path).where(), "")

    def problem(self, text: str) -> Problem:
        """Return a problem with this text at the place of the use."""
        place = self.place()
        return Problem(place.file, place.line, place.column, text)


def across(configs: Sequence[Config], one_machine: bool = True) -> Found:
    """Return the errors and warnings that two or more of these files cause together."""
    claims = [claim for config in configs for claim in _claims(config, one_machine)]
    errors = [*_domains(configs), *taken(configs, one_machine), *_nowhere(configs)]
    gateways = [claim for config in configs for claim in _gateways(config)]
    warnings = [_shared(pair, claims) for pair in _twice(gateways)]
    return Found(errors, [*warnings, *_wires(configs), *_unspoken(configs)])


def taken(configs: Sequence[Config], one_machine: bool = True) -> Iterator[Problem]:
    """Yield a problem for each thing that two files use, although only one file may use it. Such things
    are ports, pins, points of a unit, RMF names and names of nodes."""
    lines = list(_twice(c for config in configs for c in _lines(config, one_machine)))
    busy = {claim.what for claim, _ in lines}
    claims = (c for config in configs for c in _claims(config, one_machine))
    rest = (c for c in claims if not any(c.what.endswith(f" of {b}") for b in busy))
    yield from map(_taken, (*lines, *_twice(rest)))
    yield from map(_one_node, _twice(_nodes(configs, one_machine)))


def _nodes(configs: Sequence[Config], one_machine: bool) -> Iterator[ExclusiveUse]:
    """Yield the name of each daemon's node. Daemons of several machines meet only on a network."""
    for config in configs:
        if one_machine or config.rmf.network != "localhost":
            yield ExclusiveUse(config, config.node, ("kind",))


def _one_node(pair: tuple[ExclusiveUse, ExclusiveUse]) -> Problem:
    claim, other = pair
    return claim.problem(
        f"the node '{claim.what}' is that of {other.config.path} too: rename one of the two files,"
        " because daemons with one node name do not hear each other's alarm"
    )


def shared_secrets(configs: Sequence[Config]) -> Iterator[Problem]:
    """Yield a problem for each secret file that two services use. Only one user can own a secret file,
    and each service has its own user."""
    uses = (
        ExclusiveUse(config, file, path)
        for config in configs
        for path, file in named_files(config, SECRETS)
    )
    for claim, other in _twice(uses):
        text = "give each service a copy, because each has a user of its own"
        yield claim.problem(f"{claim.what} is the secret of {other.config.path} too: {text}")


def _twice(claims: Iterable[ExclusiveUse]) -> Iterator[tuple[ExclusiveUse, ExclusiveUse]]:
    """Yield (later use, first use) for each thing that two files use. Two uses within one file are left
    out, because the loader has checked them."""
    first: dict[str, ExclusiveUse] = {}
    for claim in claims:
        other = first.setdefault(claim.what, claim)
        if other.config is not claim.config:
            yield claim, other


def _taken(pair: tuple[ExclusiveUse, ExclusiveUse]) -> Problem:
    claim, other = pair
    first = other.place()
    return claim.problem(f"{claim.what} is used in {first.file} too, on line {first.line}")


def _buses(config: Config) -> Iterator[tuple[str, Where]]:
    for name, settings in config.buses.items():
        where = config.bus_type(name).where(settings)
        if where is not None:
            yield name, where


def _lines(config: Config, one_machine: bool) -> Iterator[ExclusiveUse]:
    """Yield one use for each port that only one daemon can open."""
    for name, where in _buses(config):
        if where.clients == "one" and one_machine:
            yield ExclusiveUse(config, where.text, ("buses", name))


def _gateways(config: Config) -> Iterator[ExclusiveUse]:
    """Yield the use of each gateway's address. Some makes of gateway accept only one client."""
    for name, where in _buses(config):
        if where.clients is None:
            yield ExclusiveUse(config, where.text, ("buses", name))


def _claims(config: Config, one_machine: bool) -> Iterator[ExclusiveUse]:
    """Yield the uses of names in RMF, and of points and devices on buses."""
    kind = kind_called(config.kind)
    if isinstance(kind, GraphKind):
        yield ExclusiveUse(config, f"kind: {kind.name}", ("kind",))
        return
    of = f" of {config.section.config}" if kind.section else ""
    what = "robot" if kind.section else kind.name
    for name in config.devices:
        yield ExclusiveUse(config, f"the {what} '{name}'{of}", (kind.devices_key, name))
    for bus, where in _buses(config):
        if one_machine or not where.local:
            for place, path in config.bus_type(bus).claims(config.buses[bus]):
                yield ExclusiveUse(config, f"{place} of {where.text}", ("buses", bus, *path))
            for device in config.devices:
                for place, path in _places(config, bus, device):
                    what = f"{place} of {where.text}"
                    yield ExclusiveUse(config, what, (kind.devices_key, device, *path))


def _places(config: Config, bus: str, device: str) -> Iterator[tuple[str, Path]]:
    """Yield every point of a device on this bus, and every other thing on the bus that only this device
    may use. The names are in the bus's own spelling."""
    hal = config.bus_type(bus)
    for wire in config.wires_on(bus, device):
        flash = [("flash", wire.flash.point)] if wire.flash is not None else []
        for key, point in [("point", wire.point), *flash]:
            if what := hal.place(config.buses[bus], hal.canonical(point)):
                yield what, (*wire.path, key)
    if bus == config.bus_of(device):
        yield from config.driver_type(device).claims(config.devices[device])


def _shared(pair: tuple[ExclusiveUse, ExclusiveUse], claims: Sequence[ExclusiveUse]) -> Problem:
    """Return the warning about a gateway in two files. The warning names the units that both files
    read."""
    claim, other = pair
    both = _units(claim.config, claim.what, claims) & _units(other.config, claim.what, claims)
    units = f" for unit {', '.join(sorted(both))}" if both else ""
    text = f"warning: {claim.what} is also polled in {other.config.path}{units}"
    return claim.problem(
        f"{text}: many gateways take only one client: use one file for each gateway"
    )


def _units(config: Config, gateway: str, claims: Sequence[ExclusiveUse]) -> set[str]:
    ours = (c.what.split() for c in claims if c.config is config and c.what.endswith(gateway))
    return {words[1] for words in ours if words[0] == "unit"}


def _domains(configs: Sequence[Config]) -> Iterator[Problem]:
    for config in configs[1:]:
        ours, first = (c.rmf.domain_id or 0 for c in (config, configs[0]))
        if ours != first:
            text = f"DDS domain {ours}, but {configs[0].path} is in domain {first}"
            place = ExclusiveUse(config, "", ("rmf", "domain_id"))
            yield place.problem(f"{text}: the daemons cannot hear each other")


def _wires(configs: Sequence[Config]) -> Iterator[Problem]:
    """Yield a warning for each file on another wire than an earlier file. ROS 2 and `auto` may be on
    either wire."""
    named = [config for config in configs if config.rmf.transport in ("dds", "zenoh")]
    for config in named[1:]:
        first, ours = named[0], config.rmf.transport
        if ours != first.rmf.transport:
            text = f"warning: transport {ours}, but {first.path} has {first.rmf.transport}"
            place = ExclusiveUse(config, "", ("rmf", "transport"))
            yield place.problem(f"{text}: without a bridge the daemons do not hear each other")


def _devices(configs: Sequence[Config], kind: str) -> dict[str, Config]:
    return {name: c for c in configs if c.kind == kind for name in c.devices}


def _nowhere(configs: Sequence[Config]) -> Iterator[Problem]:
    """Yield a problem for each device that a supervisor or coordinator names and no file defines."""
    for claim, kind, name in _spoken(configs):
        known = _devices(configs, kind)
        if known and name not in known:
            yield claim.problem(unknown(kind, name, known))


def _unspoken(configs: Sequence[Config]) -> Iterator[Problem]:
    """Yield a warning for each device that a supervisor or coordinator does not name, although it names
    other devices of that kind."""
    spoken = [(kind, name, claim) for claim, kind, name in _spoken(configs)]
    for kind in sorted({kind for kind, _, _ in spoken}):
        names = {name for k, name, _ in spoken if k == kind}
        speaker = next(claim.config for k, _, claim in spoken if k == kind)
        for name, config in _devices(configs, kind).items():
            if name not in names:
                key = kind_called(kind).devices_key
                text = f"warning: '{name}' is not served: {speaker.path} does not name it"
                yield ExclusiveUse(config, "", (key, name)).problem(text)


def _spoken(configs: Sequence[Config]) -> Iterator[tuple[ExclusiveUse, str, str]]:
    for config in configs:
        kind = kind_called(config.kind)
        if isinstance(kind, GraphKind):
            for path, what, name in kind.speaks_of(config.section):
                yield ExclusiveUse(config, name, (kind.devices_key, *path)), what, name
