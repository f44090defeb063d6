"""Drivers for lifts: one file for each way of connecting a lift."""
