"""Drivers for hatches."""
