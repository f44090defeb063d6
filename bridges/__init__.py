"""rmf-bridges: daemons that connect Open-RMF to the lifts, doors and chargers of a building."""

__version__ = "0.1.0"
BUILD = ""
"""The commit, written by setup.py into the installed package; `release` for the version itself; "" if
unknown."""
VERSION = __version__ if BUILD in ("", "release") else f"{__version__}+{BUILD}"
