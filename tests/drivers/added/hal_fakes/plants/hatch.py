"""A hatch that moves like a door."""

from hal_fakes.plants import door

FAKE = door.FAKE
