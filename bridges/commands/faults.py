"""What each fault means and what to do: faults.yaml, for `status` and for docs/faults.md.

`python -m bridges.commands.faults > docs/faults.md` writes the page.
"""

from pathlib import Path
from typing import Final

import msgspec
import yaml

HEAD: Final = """\
# Faults, by name

What `rmf-bridge status`, `watch`, the log and ROS's `/diagnostics` call a fault, its likely cause
and what to do. `rmf-bridge status` prints the same for the faults that are there now. Other symptoms:
[troubleshooting.md](troubleshooting.md).

| fault | likely cause | do |
|---|---|---|
"""


class Remedy(msgspec.Struct, frozen=True):
    """The likely cause of a fault, and what to do."""

    cause: str
    do: str


def remedies() -> dict[str, Remedy]:
    """Each fault's remedy, by its code."""
    text = Path(__file__).with_suffix(".yaml").read_text(encoding="utf-8")
    return msgspec.convert(yaml.safe_load(text), dict[str, Remedy])


def page() -> str:
    """docs/faults.md."""
    rows = (f"| `{code}` | {one.cause} | {one.do} |" for code, one in remedies().items())
    return HEAD + "\n".join(rows) + "\n"


if __name__ == "__main__":
    print(page(), end="")
