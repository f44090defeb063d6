"""rmf-bridges: daemons that connect Open-RMF to the lifts, doors and chargers of a building."""

__version__ = "0.1.0"
BUILD = ""
"""The commit of this build, which setup.py writes into the installed package. The value is `release`
for a released version, and "" if the commit is unknown."""
VERSION = __version__ if BUILD in ("", "release") else f"{__version__}+{BUILD}"
