"""Find the device that a command names, among the devices of a YAML file."""

from bridges.settings.config import Config


class NoDevice(Exception):
    """The command names no device of the file. The error's text gives the remedy."""


def device_of(config: Config, name: str | None) -> str:
    """Return the named device. Without a name, return the only device. Raises NoDevice."""
    names = list(config.devices)
    if not names:
        raise NoDevice(f"a {config.kind} has no wires")
    if name is None and len(names) > 1:
        raise NoDevice(f"--device is needed: the file has {', '.join(names)}")
    if name not in (None, *names):
        raise NoDevice(f"the file has no device '{name}'; it has {', '.join(names)}")
    return name or names[0]
