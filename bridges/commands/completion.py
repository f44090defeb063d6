"""`rmf-bridge completion SHELL` prints a completion script for a shell.

With this script the shell completes our commands and options. It also completes the names of a file's
devices and of this machine's services.
"""

import argparse
from typing import Final

SHELLS = ("bash", "zsh", "fish")
WHERE: Final = """\
where each shell looks for the script:
  bash: rmf-bridge completion bash > ~/.local/share/bash-completion/completions/rmf-bridge
  zsh:  rmf-bridge completion zsh > ~/.zfunc/_rmf-bridge
        and in ~/.zshrc, before compinit: fpath=(~/.zfunc $fpath)
  fish: rmf-bridge completion fish > ~/.config/fish/completions/rmf-bridge.fish
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the argument of `completion`."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = f"{parser.description}\n\n{WHERE}"
    parser.add_argument("shell", choices=SHELLS)


def run(args: argparse.Namespace) -> int:
    """Print the script."""
    from argcomplete.shell_integration import shellcode

    print(shellcode(["rmf-bridge"], shell=args.shell), end="")
    return 0
