"""Drivers for lifts. Each way to connect a lift has a file."""
