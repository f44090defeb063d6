"""Reads one bus of a device YAML: its `type`, and the settings of that type."""

from msgspec import Struct
from yaml import MappingNode, ScalarNode

from bridges.kinds.shared.remarks import Remarks
from bridges.settings import names as named
from bridges.settings.top import word
from bridges.yaml.parsing import YamlFile
from bridges.yaml.positions import MappingEntry, below
from bridges.yaml.spelling import either, nearest, unknown
from bridges.yaml.values import BROKEN, Values
from drivers.hal import AnyBus, Where


class BusRead(Struct, frozen=True):
    """The part of a bus that could be read.

    `type` and `hal` are None if the type is missing or wrong. `settings` is BROKEN if the settings are
    wrong. `where` is the hardware that the bus uses; None if the bus has a problem.
    """

    entry: MappingEntry
    type: str | None = None
    hal: AnyBus | None = None
    settings: object = BROKEN
    where: Where | None = None

    def remarks(self) -> Remarks:
        """Yield a remark on each valid setting of the bus that may be a mistake."""
        return self.hal.warnings(self.settings) if self.hal and self.settings is not BROKEN else ()


def read_bus(
    entry: MappingEntry, allowed: list[str], driver: str, values: Values, page: YamlFile
) -> BusRead:
    """Read a bus, and note problems on the page. `allowed` lists the bus types that the file's drivers
    can use."""
    if not isinstance(entry.value, MappingNode):
        values.entries(entry.spot())
        return BusRead(entry)
    kind = below(entry.value, "type")
    if kind is None:
        _note_untyped(entry, allowed, values, page)
        return BusRead(entry)
    if _is_other_type(kind, allowed):
        text = f"'type' is '{kind.value.value}', but the driver '{driver}' needs a bus of type"
        page.note(kind.value, f"{text} {either(allowed)}")
        return BusRead(entry)
    name = word(values, kind, allowed)
    if name is None:
        return BusRead(entry)
    hal = named.bus_called(name)
    before = len(page.problems)
    settings = values.make(hal.settings, entry.spot(), ("type",))
    where = hal.where(settings) if len(page.problems) == before else None
    return BusRead(entry, name, hal, settings, where)


def _note_untyped(bus: MappingEntry, allowed: list[str], values: Values, page: YamlFile) -> None:
    """Note that a bus has no `type`, or a misspelt `type`. Do not check its other keys, because only
    the type gives them a meaning."""
    entries = {e.name: e for e in values.entries(bus.spot())}
    near = nearest("type", entries)
    if near is None:
        page.note(bus.key, f"'{bus.name}' needs 'type': {either(allowed)}")
    else:
        page.note(entries[near].key, unknown("key", near, ["type"]))


def _is_other_type(kind: MappingEntry, allowed: list[str]) -> bool:
    """Return whether this bus type exists, although no driver of the file can use it."""
    others = set(named.bus_types()).difference(allowed)
    return isinstance(kind.value, ScalarNode) and kind.value.value in others
