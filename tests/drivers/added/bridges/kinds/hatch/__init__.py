"""Hatches. For RMF a hatch is a door, but the YAML file has a separate section for hatches."""

from msgspec.structs import replace

from bridges.kinds.door import KIND as DOOR

KIND = replace(DOOR, name="hatch", devices_key="hatches")
