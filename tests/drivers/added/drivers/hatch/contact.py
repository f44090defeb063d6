"""A hatch on contacts, as a door's."""

from msgspec.structs import replace

from drivers.door.dry_contact import DRIVER as DOOR

DRIVER = replace(DOOR, buses=("modbus",))
