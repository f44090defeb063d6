"""Tests of the YAML loader. They use the real kinds, drivers and buses, and also the kind, drivers and
buses in the folder `site/`."""
