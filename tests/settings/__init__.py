"""Tests of the YAML loader. They use the real kinds, drivers and buses, and those of the folder
`site/`."""
