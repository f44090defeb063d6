"""The service of a fleet. It connects RMF's fleet adapter with the buses of the robots."""
