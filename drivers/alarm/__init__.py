"""Drivers for alarm panels: one file for each way of connecting a panel."""
