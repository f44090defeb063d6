"""Drivers for lifts: a file for each way of wiring one."""
