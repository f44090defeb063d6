"""`rmf-bridge migrate FILE` replaces old names of keys in a device YAML by the present names."""

import argparse
import os
import sys
from pathlib import Path

from bridges.settings.load import Config, SettingsError, load
from bridges.settings.rewritten import NeedsHand, rewritten
from bridges.system import files
from bridges.system.written import not_written


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `migrate`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the device YAML")
    parser.add_argument(
        "--dry-run", action="store_true", help="print the difference, and write nothing"
    )


def run(args: argparse.Namespace) -> int:
    """Return 0 if the file has no old key any more. Return 65 if a person must change the file, 73 if
    it cannot be written, and 78 if it is invalid."""
    try:
        config = load(args.file)
        text = rewritten(config)
    except SettingsError as error:
        print("\n".join(map(str, error.problems)), file=sys.stderr)
        return os.EX_CONFIG
    except NeedsHand as error:
        print(f"{args.file} must be changed by hand: {error}", file=sys.stderr)
        print("`rmf-bridge check` names each old key and what to write", file=sys.stderr)
        return os.EX_DATAERR
    if args.dry_run:
        _print_difference(config, text)
        return 0
    return _written(config, text)


def _written(config: Config, text: str) -> int:
    """Replace the file if the text has changed. Keep the file's mode and owner."""
    if text.encode() == config.text:
        print(f"{config.path} has no old key")
        return 0
    real = config.path.resolve()
    try:
        files.replace(real, text.encode(), like=real.stat())
    except OSError as error:
        return not_written(config.path, error.strerror)
    print(f"{config.path} is rewritten")
    return 0


def _print_difference(config: Config, text: str) -> None:
    from difflib import unified_diff

    before = config.text.decode().splitlines(keepends=True)
    name = str(config.path)
    sys.stdout.writelines(unified_diff(before, text.splitlines(keepends=True), name, name))
