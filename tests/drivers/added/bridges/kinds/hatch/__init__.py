"""Hatches: doors for RMF, with their own section of the YAML."""

from msgspec.structs import replace

from bridges.kinds.door import KIND as DOOR

KIND = replace(DOOR, name="hatch", devices_key="hatches")
