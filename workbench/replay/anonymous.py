"""Anonymise an incident. Each name of the site is replaced by `name01`, `name02` and so on. One name
gets the same replacement everywhere.

Names come from four places: name fields of RMF's messages, single words in cores' memories, the
devices, and the YAML. A core is the part of a daemon that decides. This module replaces the names in
messages, memories, notes and the YAML, also inside longer texts. The new names sort in the same order
as the old names, because cores sort by names.

The program's own words stay, because new words would change the recording. These words are keys and
values of the YAML, words of a core, and topics. The YAML's comments are removed. The YAML's path
becomes `/anonymous.yaml`, and the addresses of its buses become `192.0.2.1`, also in longer texts.
"""

import enum
import inspect
import pkgutil
import re
import typing
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Final
from urllib.parse import urlsplit

import msgspec
import yaml
from msgspec.structs import replace

from bridges.blackbox.entries import (
    AnyEntry,
    Clocks,
    DaemonDied,
    DaemonEnded,
    Decided,
    EntriesLost,
    Head,
    Known,
    Spoken,
)
from bridges.blackbox.incident import Incident
from bridges.blackbox.value_codec import HOLDS, TYPE, Tree
from bridges.kinds import kind_called, kind_names
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.messages import cdr
from bridges.messages.definitions import DiagnosticStatus, Message
from bridges.messages.heard import FREE_TEXTS
from bridges.messages.releases import RELEASES
from bridges.messages.rihs01 import MESSAGES
from bridges.runtime.faults import remedies
from bridges.settings.config import Config
from workbench.commissioning.json_schema import schema
from workbench.replay.replayed import of_head
from workbench.replay.sources import TOPICS

SAID: Final = FREE_TEXTS | {"code", "detail", "reason", "code_fault", "errors", "lost", "io_fault"}
"""Fields in which a core writes its own words, so that they contain no names."""
NAME: Final = re.compile(r"(?!\d+$)[\w./-]{1,128}")
ADDRESS: Final = "192.0.2.1"
ANONYMOUS: Final = "/anonymous.yaml"
HOSTS: Final = ("host", "api_base", "url")

Swap = Callable[[str], str]


def anonymous(incident: Incident) -> Incident:
    """Return the incident without names. Raises SettingsError if today's rules refuse the incident's
    YAML."""
    config = of_head(incident.head)
    content = yaml.safe_load(incident.head.yaml)
    file = incident.head.file
    own = {Path(file).stem, *_subjects(incident), *_own_names(config, content)}
    whole = {*own, *_spoken_names(incident), *_remembered(incident)}
    found = {part for name in whole for part in name.split("/")}
    hosts = {_host(bus[key]): ADDRESS for bus, key in _addresses(content.get("buses", {}))}
    places = {**hosts, **({file: ANONYMOUS} if file else {})}
    swap = _swap(sorted(found - our_words() - {"", *places}, key=_longest_first), places)
    return Incident(
        _head(incident.head, content, swap),
        [_entry(entry, swap) for entry in incident.entries],
        tuple(replace(n, text=swap(n.text), subject=swap(n.subject)) for n in incident.notes),
    )


def _longest_first(name: str) -> tuple[int, str]:
    return -len(name), name


def _swap(names: list[str], places: Mapping[str, str]) -> Swap:
    """Return a function that replaces names and places in a text. `places` maps a host or path to its
    replacement. A name may be only a part of the text. The longest name is replaced first."""
    width = len(str(len(names)))
    aliases = {name: f"name{number:0{width}}" for number, name in enumerate(sorted(names), 1)}
    aliases |= places
    if not aliases:
        return lambda text: text
    every = sorted(aliases, key=_longest_first)
    pattern = re.compile(r"(?<!\w)(?:" + "|".join(map(re.escape, every)) + r")(?!\w)")
    return lambda text: pattern.sub(lambda match: aliases[match[0]], text)


def _spoken_names(incident: Incident) -> Iterator[str]:
    for entry in incident.entries:
        if isinstance(entry, Spoken):
            yield entry.node
            yield from _names_in(_decoded(entry))


def _decoded(spoken: Spoken) -> Message | None:
    try:
        return cdr.decode(MESSAGES[spoken.type], spoken.cdr, RELEASES[spoken.release])
    except (KeyError, cdr.CdrError):
        return None


def _names_in(value: object, field: str = "") -> Iterator[str]:
    if isinstance(value, str):
        if field not in FREE_TEXTS:
            yield value
    elif isinstance(value, tuple):
        for part in value:
            yield from _names_in(part, field)
    elif isinstance(value, DiagnosticStatus):  # the keys of its values are our words
        yield from (*value.name.split(": "), value.hardware_id)
    elif isinstance(value, msgspec.Struct):
        for name in value.__struct_fields__:
            yield from _names_in(getattr(value, name), name)


def _remembered(incident: Incident) -> Iterator[str]:
    """Yield each text of a single word in a memory or an event, except the words that a core itself
    uses."""
    for entry in incident.entries:
        if isinstance(entry, Known):
            yield from _tree_names([entry.memory, entry.reading])
        elif isinstance(entry, Decided):
            yield from _tree_names([entry.event, *entry.publish])


def _tree_names(told: Tree) -> Iterator[str]:
    if isinstance(told, str):
        if NAME.fullmatch(told):
            yield told
    elif isinstance(told, list):
        for part in told:
            yield from _tree_names(part)
    elif isinstance(told, dict) and not isinstance(told.get(HOLDS), str):
        for key, part in told.items():
            if key not in (TYPE, *SAID):
                yield from _tree_names(part)


def _subjects(incident: Incident) -> Iterator[str]:
    for entry in incident.entries:
        if subject := getattr(entry, "subject", ""):
            yield subject


def _own_names(config: Config, content: dict[str, Any]) -> Iterator[str]:
    """Yield the names of the devices and places in the YAML. A kind without hardware, such as a
    coordinator, has no such list, so yield every word of its section."""
    kind = kind_called(config.kind)
    yield from content.get("rmf", {}).get("topics", {}).values()
    if isinstance(kind, GraphKind):
        yield from _words(content.get(kind.devices_key))
        return
    for name, device in config.devices.items():
        yield name
        yield from (place for _, _, place in kind.on_map(device))


def _words(value: object) -> Iterator[str]:
    if isinstance(value, str) and re.fullmatch(r"\w[\w /.-]*", value) and not value.isdecimal():
        yield value
    elif isinstance(value, dict):
        for key, part in value.items():
            yield from (*_words(key), *_words(part))
    elif isinstance(value, list):
        for part in value:
            yield from _words(part)


@cache
def our_words() -> frozenset[str]:
    """Return every key and word of the program itself that a YAML or a core may contain."""
    found = {"site", "daemon", *TOPICS, *remedies()}
    _schema_words(schema(), found)
    for kind in kind_names():
        package = f"bridges.kinds.{kind}"
        for file in pkgutil.iter_modules(import_module(package).__path__, f"{package}."):
            found |= set(_module_words(import_module(file.name)))
    return frozenset(found)


def _schema_words(part: object, found: set[str]) -> None:
    if isinstance(part, dict):
        found |= set(part.get("properties", ())) | {str(part.get("const", ""))}
        found |= {str(word) for word in part.get("enum", ())}
        for below in part.values():
            _schema_words(below, found)
    elif isinstance(part, list):
        for below in part:
            _schema_words(below, found)


def _module_words(module: ModuleType) -> Iterator[str]:
    """Yield the words that a module's types define: literals and values of enumerations."""
    for kind in vars(module).values():
        if inspect.isclass(kind) and issubclass(kind, enum.Enum):
            yield from (str(member.value) for member in kind)
        elif inspect.isclass(kind) and (issubclass(kind, msgspec.Struct)):
            for hint in typing.get_type_hints(kind).values():
                yield from _literals(hint)


def _literals(hint: object) -> Iterator[str]:
    for part in typing.get_args(hint):
        if isinstance(part, str):
            yield part
        else:
            yield from _literals(part)


def _head(head: Head, content: dict[str, Any], swap: Swap) -> Head:
    for bus, key in _addresses(content.get("buses", {})):
        bus[key] = f"http://{ADDRESS}" if "://" in bus[key] else ADDRESS
    content.get("rmf", {}).pop("zenoh", None)
    text = yaml.safe_dump(_swapped(content, swap), sort_keys=False, allow_unicode=True)
    return replace(head, yaml=text.encode(), file=ANONYMOUS)


def _addresses(part: object) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield each mapping with an address, and the address's key."""
    for key, value in part.items() if isinstance(part, dict) else ():
        if key in HOSTS and isinstance(value, str):
            yield part, key  # type: ignore[misc]
        else:
            yield from _addresses(value)


def _host(value: str) -> str:
    """Return the host in a host's name or a URL. The drivers' errors name it."""
    return urlsplit(value).hostname or value if "://" in value else value


def _swapped(value: Any, swap: Swap) -> Any:
    if isinstance(value, str):
        return swap(value)
    if isinstance(value, dict):
        return {_swapped(key, swap): _swapped(part, swap) for key, part in value.items()}
    return [_swapped(part, swap) for part in value] if isinstance(value, list) else value


def _entry(entry: AnyEntry, swap: Swap) -> AnyEntry:
    if isinstance(entry, Clocks | DaemonEnded | EntriesLost):
        return entry
    if isinstance(entry, DaemonDied):
        return replace(entry, reason=swap(entry.reason))
    if isinstance(entry, Spoken):
        return _said(entry, swap)
    changed = {
        name: _tree(getattr(entry, name), swap)
        for name in entry.__struct_fields__
        if name not in ("at", "times", "anew")
    }
    return replace(entry, **changed)


def _said(spoken: Spoken, swap: Swap) -> Spoken:
    message = _decoded(spoken)
    if message is None:
        return replace(spoken, cdr=b"", topic=swap(spoken.topic), node=swap(spoken.node))
    told = cdr.encode(MESSAGES[spoken.type], _message(message, swap), RELEASES[spoken.release])
    return replace(spoken, cdr=told, node=swap(spoken.node))


def _message(value: Any, swap: Swap) -> Any:
    if isinstance(value, str):
        return swap(value)
    if isinstance(value, tuple):
        return tuple(_message(part, swap) for part in value)
    if isinstance(value, msgspec.Struct):
        fields = value.__struct_fields__
        return type(value)(**{name: _message(getattr(value, name), swap) for name in fields})
    return value


def _tree(told: Tree, swap: Swap) -> Tree:
    """Return the tree with its texts replaced. Keep the names of types, fields and members."""
    if isinstance(told, str):
        return swap(told)
    if isinstance(told, list):
        return [_tree(part, swap) for part in told]
    if not isinstance(told, dict):
        return told
    if isinstance(told.get(HOLDS), str):
        return told
    return {key: part if key == TYPE else _tree(part, swap) for key, part in told.items()}
