"""Tests of the robots' drivers, on real wires with simulated robots that drive."""
