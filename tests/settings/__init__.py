"""Tests of the YAML loader with the real kinds, drivers and buses, and with those of the folder
`site/`."""
