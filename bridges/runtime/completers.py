"""What completes the names of devices and services in a shell."""

import argparse
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

Completer = Callable[..., list[str]]
"""As argcomplete calls it: with the prefix and what was typed so far."""


def completed_by(argument: argparse.Action, completer: Completer) -> None:
    """Let a shell complete this argument by `completer`."""
    argument.completer = completer  # type: ignore[attr-defined]  # argcomplete's way


def device_names(prefix: str, parsed_args: argparse.Namespace, **_: object) -> list[str]:
    """The devices of FILE; none if it is not a valid device YAML."""
    from bridges.settings.load import SettingsError, load

    with suppress(SettingsError, OSError, TypeError):
        return list(load(parsed_args.file).devices)
    return []


def service_names(prefix: str, parsed_args: argparse.Namespace, **_: object) -> list[str]:
    """The services that have a YAML in /etc/rmf-bridges, and files that begin so."""
    from argcomplete.completers import FilesCompleter

    from bridges.runtime.services import CONFIG

    files: list[str] = list(FilesCompleter(allowednames=("yaml", "yml"))(prefix))
    return sorted({file.stem for file in (Path("/") / CONFIG).glob("*.yaml")}) + files
