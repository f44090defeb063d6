"""The causes and remedies of faults, from faults.yaml, for `status` and docs/reference/faults.md.

`python -m bridges.runtime.faults > docs/reference/faults.md` writes the page.
"""

import re
import shlex
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Final

import msgspec
import yaml

QUOTED: Final = re.compile(r"`([^`]*)`")
HEAD: Final = """\
# Faults, by name

This page lists each fault with its likely cause and the remedy. `rmf-bridge status`, `watch`, the log
and ROS's `/diagnostics` show the names of faults. `rmf-bridge status` also prints this advice for the
present faults. For other symptoms see [Troubleshoot](../how-to/troubleshoot.md).

| fault | likely cause | do |
|---|---|---|
"""


class Remedy(msgspec.Struct, frozen=True):
    """The likely cause of a fault, and the remedy."""

    cause: str
    do: str


def remedies() -> dict[str, Remedy]:
    """Return the remedy of each fault, by the fault's code."""
    text = Path(__file__).with_suffix(".yaml").read_text(encoding="utf-8")
    return msgspec.convert(yaml.safe_load(text), dict[str, Remedy])


def values(file: str, device: str) -> dict[str, str]:
    """Return the settings of a device as text, by their keys, from the daemon's YAML. Return nothing
    for an invalid YAML."""
    from bridges.settings.load import SettingsError, load

    try:
        settings = load(Path(file)).devices.get(device)
    except (SettingsError, OSError):
        return {}
    parts = [settings, getattr(settings, "limits", None)]
    found = {k: v for part in parts if part for k, v in msgspec.structs.asdict(part).items()}
    return {
        key: f"{value:g} s" if key.endswith("_s") else f"{value}"
        for key, value in found.items()
        if isinstance(value, int | float | str)
    }


def here(remedy: Remedy, file: str, device: str, known: Mapping[str, str]) -> Remedy:
    """Return the remedy for this device. In its text, replace FILE and NAME by this file and this
    device, and replace the names of settings by the device's values."""
    names = {"FILE": shlex.quote(file)} if file else {}
    names |= (
        dict.fromkeys(("NAME", "LIFT", "DOOR", "CHARGER"), shlex.quote(device)) if device else {}
    )

    def named(quoted: re.Match[str]) -> str:
        text = re.sub(r"\b[A-Z]+\b", lambda word: names.get(word[0], word[0]), quoted[1])
        return f"`{text}` ({known[text]})" if text in known else f"`{text}`"

    return Remedy(*(QUOTED.sub(named, text) for text in (remedy.cause, remedy.do)))


@cache
def for_explain() -> dict[str, tuple[str, str]]:
    """Return the cause and the remedy of each fault, by the fault's code, for `workbench/explain/`."""
    return {code: (one.cause, one.do) for code, one in remedies().items()}


def page() -> str:
    """Return the text of docs/reference/faults.md."""
    rows = (f"| `{code}` | {one.cause} | {one.do} |" for code, one in remedies().items())
    return HEAD + "\n".join(rows) + "\n"


if __name__ == "__main__":
    print(page(), end="")
