"""Hatches: to RMF they are doors, with a section of their own in the YAML."""

from msgspec.structs import replace

from bridges.kinds.door import KIND as DOOR

KIND = replace(DOOR, name="hatch", devices_key="hatches")
