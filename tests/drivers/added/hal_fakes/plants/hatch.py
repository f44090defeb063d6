"""A hatch moves as a door does."""

from hal_fakes.plants import door

FAKE = door.FAKE
