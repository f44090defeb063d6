"""The certificates that a device YAML names, by the keys that name them."""

from typing import Final

from bridges.settings.config import Config
from bridges.settings.cross_file_checks import named_files

CERTIFICATES: Final = ("ca", "certificate", "ca_file", "certificate_file")


def certificate_files(config: Config) -> dict[str, str]:
    """Return the named files, such as `rmf.zenoh.tls.ca` -> `/etc/rmf-bridges/ca.pem`."""
    return {
        ".".join(map(str, use.path)): str(use.what) for use in named_files(config, CERTIFICATES)
    }
