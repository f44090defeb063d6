"""Mistakes that people make in a device YAML (`mistakes.toml`), and the first message of `check` for
each."""

import tomllib
from pathlib import Path
from typing import Any, Final

import pytest

from bridges.settings.load import load
from bridges.yaml.problems import SettingsError

HERE: Final = Path(__file__).parent
CONFIG: Final = HERE.parents[1] / "config"
MISTAKES: Final = tomllib.loads((HERE / "mistakes.toml").read_text())["mistake"]
OTHERWISE: Final = {
    "makers addresses": "refused: the message gives both spellings, and check accepts 0x2711",
    "timeout too long for line": "refused: no call may take more than 5 s",
    "right yes": "refused with its spelling: YAML 1.2 reads yes as a text",
    "pin twice in and out": "other message: the first message is about the pin's level at boot",
    "host name": "accepted: a module may have a host name, and `doctor` resolves this name",
}
"""Mistakes for which `check` differs from the expectation of the mistake's author. For each mistake:
what `check` does instead, and why."""


def file_of(mistake: dict[str, Any], folder: Path) -> Path:
    """Write the example with this mistake into a file, and return its path."""
    text = (CONFIG / mistake["example"]).read_text()
    for old, new in mistake.get("changes", ()):
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    if mistake.get("windows"):
        text = "\ufeff" + text.replace("\n", "\r\n")
    path = folder / "device.yaml"
    path.write_bytes(text.encode())
    return path


def said_of(path: Path) -> tuple[str, list[str]]:
    """Return the outcome of `check` for the file, and its messages in order."""
    try:
        warnings = load(path).warnings
    except SettingsError as error:
        return "error", [problem.text for problem in error.problems]
    return "warning" if warnings else "none", [warning.text for warning in warnings]


def unlike(mistake: dict[str, Any], folder: Path) -> str:
    """Return the difference between the result of `check` and the author's expectation, or ""."""
    severity, told = said_of(file_of(mistake, folder))
    if mistake["severity"] == "none":
        return "" if severity != "error" else f"refused: {told[0]}"
    if severity != mistake["severity"]:
        return f"{severity}, not {mistake['severity']}: {' | '.join(told)}"
    heard = told[:1] if severity == "error" else told
    fits = any(
        all(any(word.lower() in text.lower() for word in words) for words in mistake["words"])
        for text in heard
    )
    return "" if fits else f"says {' | '.join(heard)}"


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake["name"])
def test_the_first_message_names_the_mistake(mistake: dict[str, Any], tmp_path: Path) -> None:
    assert (unlike(mistake, tmp_path) != "") == (mistake["name"] in OTHERWISE)
