"""Tests of the YAML loader, with a kind, drivers and buses made for the tests (`site/`) beside the real
ones.
"""
