"""Tests of the YAML loader, on a kind, drivers and buses of their own (`site/`) and the real ones."""
