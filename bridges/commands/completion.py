"""`rmf-bridge completion SHELL`: the script with which a shell completes our commands and options.

Also what completes names: of a file's devices, and of this machine's services.
"""

import argparse
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final

SHELLS = ("bash", "zsh", "fish")
WHERE: Final = """\
where a shell looks for it:
  bash: rmf-bridge completion bash > ~/.local/share/bash-completion/completions/rmf-bridge
  zsh:  rmf-bridge completion zsh > ~/.zfunc/_rmf-bridge
        and in ~/.zshrc, before compinit: fpath=(~/.zfunc $fpath)
  fish: rmf-bridge completion fish > ~/.config/fish/completions/rmf-bridge.fish
"""
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


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The argument of `completion`."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = f"{parser.description}\n\n{WHERE}"
    parser.add_argument("shell", choices=SHELLS)


def run(args: argparse.Namespace) -> int:
    """Print it."""
    from argcomplete.shell_integration import shellcode

    print(shellcode(["rmf-bridge"], shell=args.shell), end="")
    return 0
