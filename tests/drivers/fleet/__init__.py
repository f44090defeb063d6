"""Drivers of robots, on real wires against robots that drive."""
