"""Drivers for doors: one file for each way of connecting a door."""
