"""Drivers of robots: their makers' interfaces, each in its own file."""
