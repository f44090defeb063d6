"""rmf-bridges: daemons that connect Open-RMF to the lifts, doors and chargers of a building."""

__version__ = "0.1.0"
