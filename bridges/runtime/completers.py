"""Functions that complete device names and service names in a shell."""

import argparse
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

Completer = Callable[..., list[str]]
"""A function that argcomplete calls with the typed prefix and the typed arguments."""


def completed_by(argument: argparse.Action, completer: Completer) -> None:
    """Let the shell complete this argument with `completer`."""
    argument.completer = completer  # type: ignore[attr-defined]  # argcomplete's way


def device_names(prefix: str, parsed_args: argparse.Namespace, **_: object) -> list[str]:
    """Return the names of the devices in FILE. Return no names if FILE is not a valid device YAML."""
    from bridges.settings.load import SettingsError, load

    with suppress(SettingsError, OSError, TypeError):
        return list(load(parsed_args.file).devices)
    return []


def service_names(prefix: str, parsed_args: argparse.Namespace, **_: object) -> list[str]:
    """Return the services with a YAML in /etc/rmf-bridges. Also return the files that begin with
    `prefix`."""
    from argcomplete.completers import FilesCompleter

    from bridges.runtime.services import CONFIG

    files: list[str] = list(FilesCompleter(allowednames=("yaml", "yml"))(prefix))
    return sorted({file.stem for file in (Path("/") / CONFIG).glob("*.yaml")}) + files
