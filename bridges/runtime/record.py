"""The record of a daemon. It holds all data that `outputs-off` needs to switch the daemon's outputs
off. The daemon writes the record before it claims outputs.

The record holds the YAML and the validated settings. `outputs-off` uses the settings. If another
version wrote the settings, they may be undecodable. Only in that case does `outputs-off` load and check
the YAML. It ignores keys of a record that this version does not know.

A record is a file, and the file's name is a hash of the record. So a daemon that restarts on the same
YAML finds its record, and a daemon on another YAML overwrites no record. The file is in the daemon's
state directory, or in its runtime directory if the state directory cannot be written.

Records hold no tokens, because tokens are in files of their own.
"""

import hashlib
import logging
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path

import msgspec

from bridges import BUILD, VERSION
from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names
from bridges.settings.config import Config
from bridges.system import files
from bridges.system.directories import Directories, named, opened
from bridges.system.log import pairs
from drivers.profiles import texts

log = logging.getLogger(__name__)

PATTERN = "claimed-*.json"
SIZE_MAX = 64 << 20
"""The maximum size (bytes) of a record. No YAML with its profiles and DBC files is so large."""


class ClaimedSettings(msgspec.Struct, frozen=True):
    """The validated settings of a YAML. Each setting is encoded as JSON. `version`: the version of the
    program that wrote the settings."""

    version: str
    kind: str
    driver: str
    buses: dict[str, tuple[str, bytes]]
    devices: dict[str, bytes]


class Claimed(msgspec.Struct, frozen=True):
    """A record without settings. Every version of this program can read the fields from `file` to
    `safe`.

    - `file`: the YAML's path
    - `yaml`: the YAML's text
    - `texts`: maps the name of each profile or DBC file to its text
    - `safe`: the devices whose outputs are verified off
    - `tried`: whether a process has already tried to switch off the devices that are not in `safe`
    """

    file: str
    yaml: bytes
    texts: dict[str, bytes]
    safe: tuple[str, ...] = ()
    tried: bool = False


class ClaimRecord(Claimed, frozen=True):
    """A record with settings. `claim`: the settings from the YAML."""

    claim: ClaimedSettings | None = None

    @property
    def name(self) -> str:
        """The name of the record's file, which is a hash of the claim."""
        claimed = msgspec.structs.asdict(self) | {"safe": ()}
        del claimed["tried"]  # older versions lack this field, but must compute the same name
        return f"claimed-{hashlib.sha256(msgspec.json.encode(claimed)).hexdigest()[:16]}.json"

    @property
    def all_safe(self) -> bool:
        """Whether the outputs of all devices are verified off."""
        return self.claim is not None and self.claim.devices.keys() <= {*self.safe}

    def config(self) -> Config:
        """Return the Config of the record. Raises SettingsError if this version refuses the record's
        YAML.

        After this call the process uses only the record's profiles and DBC files.
        """
        texts.give(self.texts)
        with suppress(msgspec.MsgspecError, ImportError, AttributeError):
            if BUILD and self.claim is not None and self.claim.version == VERSION:
                return _claimed(self, self.claim)
        from bridges.settings.load import understood

        return understood(self.file, self.yaml)


def of(config: Config) -> ClaimRecord:
    """Return the record of this config. The process must have loaded no other config, because the
    record takes all profiles that are loaded."""
    known = dict(sorted(texts.all_known().items()))
    return ClaimRecord(named(config.path), config.text, known, claim=_claim(config))


def _claim(config: Config) -> ClaimedSettings:
    buses = {name: (config.bus_types[name], _json(bus)) for name, bus in config.buses.items()}
    devices = {name: _json(device) for name, device in config.devices.items()}
    return ClaimedSettings(VERSION, config.kind, config.driver, buses, devices)


def _json(settings: msgspec.Struct) -> bytes:
    return msgspec.json.encode(settings)


def _claimed(record: ClaimRecord, claim: ClaimedSettings) -> Config:
    """Return the Config with these settings. Raises MsgspecError, ImportError or AttributeError."""
    return Config(
        path=Path(record.file),
        text=record.yaml,
        kind=claim.kind,
        driver=claim.driver,
        rmf=Rmf(),  # a connection to RMF is not needed
        buses={
            name: msgspec.json.decode(text, type=names.bus_called(kind).settings)
            for name, (kind, text) in claim.buses.items()
        },
        devices={name: _device(claim, text) for name, text in claim.devices.items()},
        bus_types={name: kind for name, (kind, _) in claim.buses.items()},
    )


def _device(claim: ClaimedSettings, text: bytes) -> msgspec.Struct:
    """Return a device's settings, decoded for the device's driver. The device may name its own driver.
    Otherwise it has the file's driver."""
    own = msgspec.json.decode(text, type=_OwnDriver).driver or claim.driver
    device: msgspec.Struct = msgspec.json.decode(
        text, type=names.driver_called(claim.kind, own).settings
    )
    return device


class _OwnDriver(msgspec.Struct):
    driver: str | None = None


class Records:
    """The records in a daemon's directories.

    A record of another file counts too. It is there if the YAML's path was a link that now leads
    elsewhere, or if another YAML with the same name had this directory.

    A record in the runtime directory was written later than its copy in the state directory, because
    that could not be written. It therefore counts, and the copy does not.
    """

    def __init__(self, places: Directories) -> None:
        self._places = places

    def unreleased(self) -> list[ClaimRecord]:
        """Return the records whose outputs are not all off. Log unreadable records, and leave them
        out."""
        for path in paths(self._places):
            if read(path) is None:
                log.warning(pairs("record_not_read", path=path))
        return list(self.left_on().values())

    def left_on(self) -> dict[Path, ClaimRecord]:
        """Return `unreleased` with the path of each record. Log nothing."""
        by_name = dict[str, tuple[Path, ClaimRecord]]()
        for path in paths(self._places):
            if record := read(path):
                by_name[record.name] = (path, record)
        return {path: record for path, record in by_name.values() if not record.all_safe}

    def write(self, record: ClaimRecord) -> Path:
        """Write a record and return its path. Remove a copy of the record that was written elsewhere
        later, because it would count. Raises OSError if both directories cannot be written."""
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
                if refused is None:
                    self._remove_later(record)
                return path
        assert refused is not None
        raise refused

    def _remove_later(self, record: ClaimRecord) -> None:
        """Remove the copy of a record that `write` left when it could not write the first folder."""
        for folder in self._places.folders[1:]:
            with suppress(OSError), opened(folder):
                (folder / record.name).unlink(missing_ok=True)

    def still_unsafe(self, record: ClaimRecord, devices: Collection[str], config: Config) -> None:
        """Note in the record that only `devices` are not yet verified off. Raises OSError."""
        safe = tuple(name for name in config.devices if name not in devices)
        self.write(msgspec.structs.replace(record, safe=safe, tried=True))

    def release(self, record: ClaimRecord) -> None:
        """Remove a record whose outputs are all off. If a copy cannot be removed, note in the record
        that all devices are safe, because otherwise a living daemon's outputs could be switched off.
        Raises OSError if this cannot be noted either.

        If another version wrote the record, the file's name may differ from the record's `name`.
        """
        refused: OSError | None = None
        for path in list(paths(self._places)):
            if path.name == record.name or ((found := read(path)) and found.name == record.name):
                try:
                    path.unlink(missing_ok=True)
                except OSError as error:
                    refused = refused or error
        if refused is not None:
            if record.claim is None:
                raise refused
            safe = tuple(record.claim.devices)
            self.write(msgspec.structs.replace(record, safe=safe, tried=True))


def paths(places: Directories) -> Iterator[Path]:
    """Yield every file that may be a record."""
    for folder in places.folders:
        with suppress(OSError):
            yield from sorted(folder.glob(PATTERN))


def read(path: Path) -> ClaimRecord | None:
    """Return the record in a file. Return None if the file is invalid, unreadable or a symbolic
    link."""
    try:
        return _decoded(files.read(path, SIZE_MAX))
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None


def _decoded(content: bytes) -> ClaimRecord:
    """Decode a record. Raises MsgspecError or UnicodeDecodeError."""
    try:
        return msgspec.json.decode(content, type=ClaimRecord)
    except msgspec.ValidationError:  # another version wrote these settings, so keep the YAML
        return ClaimRecord(**msgspec.structs.asdict(msgspec.json.decode(content, type=Claimed)))
