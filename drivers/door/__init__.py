"""Drivers for doors: a file for each way of reaching one."""
