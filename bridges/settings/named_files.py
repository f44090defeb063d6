"""The files whose paths a device YAML gives, such as certificates and secrets."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from msgspec import Struct
from msgspec.structs import asdict

from bridges.kinds import kind_called
from bridges.settings.config import Config

Path = tuple[str, ...]

SECRETS: Final = ("private_key", "key_file", "password_file", "token_file")
"""The keys of files that only one user may read."""
CERTIFICATES: Final = ("ca", "certificate", "ca_file", "certificate_file")


def certificate_files(config: Config) -> dict[str, str]:
    """Return the certificates, such as `rmf.zenoh.tls.ca` -> `/etc/rmf-bridges/ca.pem`."""
    return {".".join(path): file for path, file in named_files(config, CERTIFICATES)}


def named_files(config: Config, keys: Sequence[str]) -> Iterator[tuple[Path, str]]:
    """Yield each file that a YAML gives as the value of one of these keys, at any depth, and the key's
    path."""
    kind = kind_called(config.kind)
    sections = {"rmf": config.rmf, "buses": config.buses, kind.devices_key: config.devices}
    return _files_at(sections, keys)


def _files_at(settings: Any, keys: Sequence[str], path: Path = ()) -> Iterator[tuple[Path, str]]:
    """Yield the path and the value of each of these keys that has a value. Look at any depth of these
    settings."""
    if isinstance(settings, Struct):
        settings = asdict(settings)
    if isinstance(settings, Mapping):
        for key, value in settings.items():
            if key in keys and value:
                yield (*path, key), str(value)
            else:
                yield from _files_at(value, keys, (*path, str(key)))
