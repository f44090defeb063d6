"""The record of what a daemon claims, written before it claims: all that is needed to switch it off.

It holds the YAML and the settings as they were validated, so that `outputs-off` need not load and
check the YAML again. If the settings do not decode, for example those of another version, it does. What
another version has added is passed over.

A record is a file named by its content, in the daemon's state directory, or in its runtime directory
if that cannot be written. So a daemon that restarts on the same YAML finds its record, and one on
another YAML overwrites none. Tokens are not in it: they are read from their files when used.
"""

import hashlib
import logging
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path

import msgspec

from bridges import BUILD, VERSION
from bridges.host import files
from bridges.host.directories import Directories, named, opened
from bridges.host.log import pairs
from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names
from bridges.settings.config import Config
from drivers.profiles import texts

log = logging.getLogger(__name__)

PATTERN = "claimed-*.json"
SIZE_MAX = 64 << 20
"""Larger than any YAML with its profiles and DBC files."""


class ClaimedSettings(msgspec.Struct, frozen=True):
    """Validated settings, each as JSON. `version`: of the program that wrote them."""

    version: str
    kind: str
    driver: str
    buses: dict[str, tuple[str, bytes]]
    devices: dict[str, bytes]


class Claimed(msgspec.Struct, frozen=True):
    """`file`: the YAML's path. `yaml`: its text. `texts`: profiles and DBC files, by name.

    `safe`: the devices whose outputs have since been verified off. Every version can read this much.
    `tried`: whether a process has come to the end of switching off the others.
    """

    file: str
    yaml: bytes
    texts: dict[str, bytes]
    safe: tuple[str, ...] = ()
    tried: bool = False


class ClaimRecord(Claimed, frozen=True):
    """`claim`: the YAML as settings."""

    claim: ClaimedSettings | None = None

    @property
    def name(self) -> str:
        """The name of its file, a hash of what was claimed."""
        claimed = msgspec.json.encode(msgspec.structs.replace(self, safe=(), tried=False))
        return f"claimed-{hashlib.sha256(claimed).hexdigest()[:16]}.json"

    def config(self) -> Config:
        """The Config that was claimed. Raises SettingsError.

        From then on this process uses the record's profiles and DBC files, and no others.
        """
        texts.give(self.texts)
        with suppress(msgspec.MsgspecError, ImportError, AttributeError):
            if BUILD and self.claim is not None and self.claim.version == VERSION:
                return _claimed(self, self.claim)
        from bridges.settings.load import understood

        return understood(self.file, self.yaml)


def of(config: Config) -> ClaimRecord:
    """The record of this config, which must be the only one that this process has loaded."""
    known = dict(sorted(texts.all_known().items()))
    return ClaimRecord(named(config.path), config.text, known, claim=_claim(config))


def _claim(config: Config) -> ClaimedSettings:
    buses = {name: (config.bus_types[name], _json(bus)) for name, bus in config.buses.items()}
    devices = {name: _json(device) for name, device in config.devices.items()}
    return ClaimedSettings(VERSION, config.kind, config.driver, buses, devices)


def _json(settings: msgspec.Struct) -> bytes:
    return msgspec.json.encode(settings)


def _claimed(record: ClaimRecord, claim: ClaimedSettings) -> Config:
    """The Config of these settings. Raises MsgspecError, ImportError or AttributeError."""
    return Config(
        path=Path(record.file),
        text=record.yaml,
        kind=claim.kind,
        driver=claim.driver,
        rmf=Rmf(),  # who switches off talks to nobody
        buses={
            name: msgspec.json.decode(text, type=names.bus_called(kind).settings)
            for name, (kind, text) in claim.buses.items()
        },
        devices={name: _device(claim, text) for name, text in claim.devices.items()},
        bus_types={name: kind for name, (kind, _) in claim.buses.items()},
    )


def _device(claim: ClaimedSettings, text: bytes) -> msgspec.Struct:
    """A device's settings, of its own driver or the file's."""
    own = msgspec.json.decode(text, type=_OwnDriver).driver or claim.driver
    device: msgspec.Struct = msgspec.json.decode(
        text, type=names.driver_called(claim.kind, own).settings
    )
    return device


class _OwnDriver(msgspec.Struct):
    driver: str | None = None


class Records:
    """The records of one file in a daemon's directories."""

    def __init__(self, places: Directories, file: Path) -> None:
        self._places = places
        self._file = named(file)

    def unreleased(self) -> list[ClaimRecord]:
        """The records not yet released; unreadable ones are named, and left out like other files'."""
        by_name = dict[str, ClaimRecord]()
        for path in paths(self._places):
            if (record := read(path)) is None:
                log.warning(pairs("record_not_read", path=path))
            elif record.file == self._file:
                by_name[record.name] = record
        return list(by_name.values())

    def write(self, record: ClaimRecord) -> Path:
        """Write a record; returns its path. Raises OSError if neither directory takes it."""
        content = msgspec.json.encode(record)
        refused: OSError | None = None
        for folder in self._places.folders:
            path = folder / record.name
            try:
                with opened(folder, make=True):
                    if read(path) != record:
                        files.replace(path, content)
            except OSError as error:
                refused = refused or error
            else:
                return path
        assert refused is not None
        raise refused

    def still_unsafe(self, record: ClaimRecord, devices: Collection[str], config: Config) -> None:
        """Note that these devices are not verified off, and all others are. Raises OSError."""
        safe = tuple(name for name in config.devices if name not in devices)
        self.write(msgspec.structs.replace(record, safe=safe, tried=True))

    def release(self, record: ClaimRecord) -> None:
        """Remove a record whose outputs are all off. Raises OSError.

        That of another version has the name which that version gave it.
        """
        for path in list(paths(self._places)):
            if path.name == record.name or ((found := read(path)) and found.name == record.name):
                path.unlink(missing_ok=True)


def paths(places: Directories) -> Iterator[Path]:
    """Every file that may be a record."""
    for folder in places.folders:
        with suppress(OSError):
            yield from sorted(folder.glob(PATTERN))


def read(path: Path) -> ClaimRecord | None:
    """The record in a file; None if it is invalid, unreadable or a symbolic link."""
    try:
        return _decoded(files.read(path, SIZE_MAX))
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None


def _decoded(content: bytes) -> ClaimRecord:
    """Raises MsgspecError or UnicodeDecodeError."""
    try:
        return msgspec.json.decode(content, type=ClaimRecord)
    except msgspec.ValidationError:  # another version's claim: the YAML beside it is enough
        return ClaimRecord(**msgspec.structs.asdict(msgspec.json.decode(content, type=Claimed)))
