"""What a daemon has claimed, written down before it claims: all that is needed to switch it off.

A record is a file of its own, named by its content, in the daemon's state directory, or where that
takes none in its runtime directory. So a daemon that starts anew on the same YAML finds its record as
it stands, and one on another YAML writes none over. Tokens are not in it: they are read where the YAML
says, when they are used.
"""

import hashlib
import os
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path

import msgspec

from bridges.serve.files import replace
from bridges.serve.places import Places, named
from bridges.settings.load import Config, understood
from drivers.profiles import texts

PATTERN = "claimed-*.json"
SIZE_MAX = 64 << 20
"""Larger than any YAML with its profiles and DBC files."""


class Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`file`: the YAML's path. `yaml`: its text. `texts`: those of profiles and DBC files, by name.

    `safe`: the devices whose outputs have been verified off since.
    """

    file: str
    yaml: bytes
    texts: dict[str, bytes]
    safe: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The name of its file, by what was claimed."""
        claimed = msgspec.json.encode(msgspec.structs.replace(self, safe=()))
        return f"claimed-{hashlib.sha256(claimed).hexdigest()[:16]}.json"

    def config(self) -> Config:
        """What was claimed. Raises SettingsError.

        The process then knows this record's texts, and no others.
        """
        texts.give(self.texts)
        return understood(self.file, self.yaml)


def of(config: Config) -> Record:
    """The record of what this process has loaded, and loaded alone."""
    return Record(named(config.path), config.text, dict(sorted(texts.all_known().items())))


class Records:
    """The records in a daemon's places that are about one file."""

    def __init__(self, places: Places, file: Path) -> None:
        self._places = places
        self._file = named(file)

    def unreleased(self) -> list[Record]:
        """What was claimed and not released; what is unreadable or about another file is left out."""
        found = (record for path in paths(self._places) if (record := read(path)))
        by_name = {record.name: record for record in found if record.file == self._file}
        return list(by_name.values())

    def write(self, record: Record) -> Path:
        """Where it stands now. Raises OSError when neither directory takes it."""
        content = msgspec.json.encode(record)
        refused: OSError | None = None
        for folder in self._places.folders:
            path = folder / record.name
            try:
                if read(path) != record:
                    replace(path, content)
            except OSError as error:
                refused = refused or error
            else:
                return path
        assert refused is not None
        raise refused

    def still_unsafe(self, record: Record, devices: Collection[str], config: Config) -> None:
        """These devices' outputs are not verified off; the others' are. Raises OSError."""
        safe = tuple(name for name in config.devices if name not in devices)
        self.write(msgspec.structs.replace(record, safe=safe))

    def release(self, record: Record) -> None:
        """Every output of it is off and let go. Raises OSError."""
        for folder in self._places.folders:
            (folder / record.name).unlink(missing_ok=True)


def paths(places: Places) -> Iterator[Path]:
    """Every file that may be a record."""
    for folder in places.folders:
        with suppress(OSError):
            yield from sorted(folder.glob(PATTERN))


def read(path: Path) -> Record | None:
    """A record; None for what is none or cannot be read. No symbolic link is followed."""
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as source:
            content = source.read(SIZE_MAX)
        return msgspec.json.decode(content, type=Record)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None
