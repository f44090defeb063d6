"""Hatches, which are doors for RMF but have their own section in the YAML file."""

from msgspec.structs import replace

from bridges.kinds.door import KIND as DOOR

KIND = replace(DOOR, name="hatch", devices_key="hatches")
