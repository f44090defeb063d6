"""Plants: the physics of lifts, doors and chargers in virtual time."""
