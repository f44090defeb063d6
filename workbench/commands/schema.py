"""`rmf-bridge schema`: print the schema of a device YAML. Editors and the documentation use the
schema."""

import argparse
import json

from workbench.commissioning import json_schema, reference
from workbench.notify.settings import NotifySettings


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `schema`."""
    parser.add_argument(
        "--markdown",
        action="store_true",
        help="print docs/reference/configuration.md, not JSON Schema",
    )


def run(args: argparse.Namespace) -> int:
    """Print the schema."""
    print(markdown() if args.markdown else json.dumps(json_schema.schema(), indent=2), end="")
    return 0


def markdown() -> str:
    """Return the configuration reference."""
    return reference.page({NotifySettings: "The file of `rmf-bridge notify`"})
