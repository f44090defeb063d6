"""Functions that load a text, and return its Config or the printed problems."""

from pathlib import Path

from bridges.settings.load import Config, SettingsError, load

RIGHT = """\
kind: gate
driver: contact
rmf: {transport: dds, domain_id: 7}
buses:
  header: {type: pins}
gates:
  north:
    lanes: [in, out]
    inputs:
      opened: {point: A0, active: high, pull: up}
      closed: {point: 1A, active: low, pull: down, debounce_s: 1e-2}
    outputs:
      hold: {point: A2, active: high}
    codes: {1: in, 2: out}
    limits: {open_s: 3, tries: 2}
"""


def problems_of(path: Path, text: str | bytes) -> list[str]:
    """Return the problems of a file with this text, as `line:column: text`."""
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    try:
        load(path)
    except SettingsError as error:
        return [str(p).removeprefix(f"{path}:") for p in error.problems]
    return []


def texts_of(path: Path, text: str) -> list[str]:
    """Return the problems of a file with this text, without line and column."""
    return [problem.partition(": ")[2] for problem in problems_of(path, text)]


def config_of(path: Path, text: str) -> Config:
    """Return the Config of a file with this text."""
    path.write_bytes(text.encode())
    return load(path)


def changed(old: str, new: str, text: str = RIGHT) -> str:
    """Return the correct file with `old` replaced by `new` at one place."""
    assert text.count(old) == 1, old
    return text.replace(old, new)
