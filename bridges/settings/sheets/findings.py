"""The findings of `check` about one file, as tables. The tables become text, JSON and the commissioning
sheet."""

import hashlib
from collections.abc import Sequence

import msgspec

from bridges.kinds import kind_called
from bridges.kinds.shared.alarming import TOPICS, AlarmingSettings, alarm_topics
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.table import Table
from bridges.messages import fallbacks
from bridges.messages.definitions import Message
from bridges.messages.topics import DIAGNOSTICS, Topic
from bridges.settings.load import Config
from bridges.settings.shown import choices_of, plain
from bridges.yaml.parsing import Problem
from drivers.hal.points import Wire

HEADINGS = ("signal", "point", "direction", "active", "pull", "debounce", "at rest", "wire broken")
BROKEN = {True: "asserted", False: "not asserted", None: "floats"}
WIRES, MEANINGS = "wires", "meanings"
"""The titles of two tables: the table of a device's wires, and the table of its messages on the bus."""
SETTINGS = ("setting", "value", "not the default")


class Part(msgspec.Struct, frozen=True, kw_only=True):
    """One controller: its name, its bus and its tables.

    - `device`: the device's name, or the kind's name if the kind has no devices
    - `bus`: the name of the device's bus, or "" without a bus
    - `tables`: the table of the wires (or of the commands and readings) first, and then all other
      tables
    """

    device: str
    bus: str
    tables: list[Table]


class BusShown(msgspec.Struct, frozen=True, kw_only=True):
    """One bus, its settings, and its own tables. One such table has the values that are written to a
    module's watchdog."""

    name: str
    type: str
    settings: dict[str, str]
    tables: list[Table] = []


class Findings(msgspec.Struct, frozen=True, kw_only=True):
    """One file, with its errors and warnings. The other fields are filled only if the file is valid.

    - `sha256`: the hash of the file's bytes. A signed sheet identifies the file by this hash.
    - `rmf`: the domain, transport and release, and the names of the topics
    - `notes`: further facts for the user
    """

    file: str
    kind: str = ""
    driver: str = ""
    sha256: str = ""
    rmf: dict[str, str] = {}
    buses: list[BusShown] = []
    parts: list[Part] = []
    notes: list[str] = []
    errors: list[Problem] = []
    warnings: list[Problem] = []


def wrong(file: str, errors: Sequence[Problem]) -> Findings:
    """Return the findings about an invalid file."""
    return Findings(file=file, errors=list(errors))


def findings(config: Config, errors: Sequence[Problem] = (), notes: Sequence[str] = ()) -> Findings:
    """Return the findings about a valid file. `errors`: the mismatches with RMF's map."""
    return Findings(
        file=str(config.path),
        kind=config.kind,
        driver=config.driver,
        sha256=hashlib.sha256(config.text).hexdigest(),
        rmf=_rmf(config),
        buses=[_bus(config, bus) for bus in config.buses],
        parts=_devices(config) if config.devices else [_graph(config)],
        notes=[*notes, *map(str, config.notes), *_lacking(config)],
        errors=list(errors),
        warnings=list(config.warnings),
    )


def _rmf(config: Config) -> dict[str, str]:
    """Return the settings that must fit RMF's settings, and the site's names of the topics."""
    rmf, kind = config.rmf, kind_called(config.kind)
    spoken = [*(() if isinstance(kind, GraphKind) else kind.stated_on), *_published(config)]
    alarms = any(map(alarm_topics, config.devices.values()))
    recorded = () if isinstance(kind, GraphKind) else kind.recorded
    heard = [*kind.requests, *recorded, *((*TOPICS.values(), DIAGNOSTICS) if alarms else ())]
    names = {topic.name: rmf.topics.get(topic.name, topic.name) for topic in (*spoken, *heard)}
    return {
        "domain": "ROS_DOMAIN_ID or 0" if rmf.domain_id is None else str(rmf.domain_id),
        "transport": rmf.transport,
        "network": rmf.network,
        "release": rmf.release,
        "publishes": ", ".join(dict.fromkeys(names[topic.name] for topic in spoken)),
        "hears": ", ".join(names[topic.name] for topic in heard) or "-",
    }


def _published(config: Config) -> list[Topic[Message]]:
    """List the topics on which the file's devices publish, except the topics of their states."""
    kind = kind_called(config.kind)
    if isinstance(kind, GraphKind):
        return [*kind.publishes]
    devices = config.devices.values()
    return [topic for one in devices for topic in (*kind.publishes(one), *alarm_topics(one))]


def _lacking(config: Config) -> list[str]:
    """Describe each message that RMF's release lacks, and its substitute."""
    untold = {s.alarm for s in config.devices.values() if _tells_nobody(s)}  # a note tells this
    topics = (topic for topic in _published(config) if topic.name not in untold)
    lines = (fallbacks.remarks(topic, config.rmf.release) for topic in topics)
    return list(dict.fromkeys(line for topic in lines for line in topic))


def _tells_nobody(settings: object) -> bool:
    return isinstance(settings, AlarmingSettings) and settings.without_fleets == "tell_nobody"


def _bus(config: Config, name: str) -> BusShown:
    settings = {key: text for key, text, _ in plain(config.buses[name]) if text != "-"}
    tables = [table for table in config.bus_type(name).tables(config.buses[name]) if table.rows]
    return BusShown(name=name, type=config.bus_types[name], settings=settings, tables=tables)


def _graph(config: Config) -> Part:
    """Describe a kind without devices by its own tables and its settings."""
    kind = kind_called(config.kind)
    assert isinstance(kind, GraphKind)
    tables = [*kind.tables(config.section), _settings(config.section)]
    return Part(device=config.kind, bus="", tables=tables)


def _devices(config: Config) -> list[Part]:
    return [_device(config, name) for bus in config.buses for name in config.devices_on(bus)]


def _device(config: Config, name: str) -> Part:
    settings, bus, driver = config.devices[name], config.bus_of(name), config.driver_type(name)
    debounce = config.debounce(name)
    late_s = max(map(config.lasts_s, config.other_buses(name)), default=0.0) if debounce else 0.0
    wires = tuple(_row(config, bus, wire, late_s) for wire in config.wires(name))
    meanings = tuple(driver.describe(settings, config.buses[bus]))
    tables = [
        Table(WIRES, HEADINGS, wires),
        Table(MEANINGS, ("what", "meaning"), meanings),
        *driver.tables(settings),
        _settings(settings),
    ]
    return Part(device=name, bus=bus, tables=[table for table in tables if table.rows])


def _settings(settings: object) -> Table:
    """Return a table of durations and choices. `bus`, `driver` and `accept_unsafe` are left out,
    because other tables show them."""
    rows = (row for row in choices_of(settings) if row[0] not in ("bus", "driver", "accept_unsafe"))
    return Table("settings", SETTINGS, tuple(rows))


def _row(config: Config, bus: str, wire: Wire, late_s: float) -> tuple[str, ...]:
    """Return a wire's row: the bus's description of the point, the YAML's spelling, and the meaning.

    `bus`: the device's own bus. `late_s`: the time (s) that is added to the debounce of each input
    (`Config.debounce`).
    """
    point = config.bus_type(wire.bus or bus).describe(wire.point)
    spelled = point if f" {wire.point} " in f" {point} " else f"{wire.point} = {point}"
    if wire.flash is not None:
        spelled += f", {wire.flash.on_s:g} s by the module at {wire.flash.point}"
    if wire.bus:
        spelled += f" on bus {wire.bus}"
    is_input = wire.direction == "in"
    return (
        wire.signal,
        spelled,
        wire.direction,
        wire.active,
        wire.pull or "-",
        _debounce(wire, late_s) if is_input else "-",
        "-" if is_input else ("high" if wire.level(False) else "low"),
        BROKEN[wire.broken_reads()],
    )


def _debounce(wire: Wire, late_s: float) -> str:
    if wire.debounce_s is None:
        return "default"
    return f"{wire.debounce_s + late_s:g} s" if wire.debounce_s + late_s else "none"
