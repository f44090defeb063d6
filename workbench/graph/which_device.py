"""The device of a file that a command is about."""

from bridges.settings.config import Config


class NoDevice(Exception):
    """No device of the file is meant; the text says what to write."""


def device_of(config: Config, name: str | None) -> str:
    """The device that is meant: the only one if none is named. Raises NoDevice."""
    names = list(config.devices)
    if not names:
        raise NoDevice(f"a {config.kind} has no wires")
    if name is None and len(names) > 1:
        raise NoDevice(f"--device is needed: the file has {', '.join(names)}")
    if name not in (None, *names):
        raise NoDevice(f"the file has no device '{name}'; it has {', '.join(names)}")
    return name or names[0]
