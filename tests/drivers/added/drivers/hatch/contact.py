"""A hatch on contacts, wired like a door."""

from msgspec.structs import replace

from drivers.door.dry_contact import DRIVER as DOOR

DRIVER = replace(DOOR, buses=("modbus",))
