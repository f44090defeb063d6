"""The lift of `config/lift_dry_contact.yaml`. It has no motion lines, so only the debounce
distinguishes a short glitch of the contact from an opening door."""

from pathlib import Path

from msgspec.structs import replace

from bridges.kinds.lift.signals import DoorReading
from bridges.settings.load import load
from drivers.lift.dry_contact import debounce
from tests.kinds.lift.story import STANDING, Building, Story

CONFIG = Path(__file__).parents[3] / "config" / "lift_dry_contact.yaml"


def test_a_contact_that_bounces_for_50_ms_at_a_passed_floor_is_no_open_door() -> None:
    shipped = dict(debounce(load(CONFIG).devices["Lift1"]))
    building = Building(replace(STANDING, door=DoorReading.CLOSED, motion=None))
    story = Story(building, debounce=shipped)
    story.run(1.0)
    for level in (None, "L2", None):
        building.set(level=level)
        story.run(story.now + 0.5)
        building.set(door=DoorReading.OPEN)
        story._scan()  # the daemon scans at each edge of a contact
        story.run(story.now + 0.05)
        building.set(door=DoorReading.CLOSED)
        story.run(story.now + 0.5)
    assert [state for _, state in story.states if "open" in state] == []


def test_a_door_that_stays_open_reads_as_open() -> None:
    shipped = dict(debounce(load(CONFIG).devices["Lift1"]))
    building = Building(replace(STANDING, door=DoorReading.CLOSED, motion=None))
    story = Story(building, debounce=shipped)
    story.run(1.0)
    building.set(door=DoorReading.OPEN)
    story.run(1.3)
    assert "open" in story.states[-1][1]
