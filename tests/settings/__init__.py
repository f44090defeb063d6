"""Tests of the YAML loader, with a kind, drivers and buses of the tests (`site/`) and the real ones."""
