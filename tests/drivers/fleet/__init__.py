"""Drivers of robots, on real wires. The simulated robots drive."""
