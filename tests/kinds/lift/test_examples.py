"""A robot's ride on the lifts of `config/`. Tests compare the outputs and the states for RMF."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.settings.load import load
from drivers.lift import dry_contact, register
from tests.kinds.lift.story import Story
from tests.kinds.lift.wired import GatewayBuilding, WiredStory

CONFIG = Path(__file__).parents[3] / "config"
ELSEWHERE = {"lift_supervisor.yaml", "lift_http.yaml", "lift_two_buses.yaml"}
"""The examples that this file leaves out. The first has no lift. The others are tested in
tests/runtime/test_http_lift.py and tests/runtime/test_other_bus.py."""
EXAMPLES = sorted({path.name for path in CONFIG.glob("lift_*.yaml")} - ELSEWHERE)
A = "fleet/a"


def in_service(name: str) -> Story:
    """Return the running lift of an example in `config/`."""
    settings: Any = load(CONFIG / name).devices["Lift1"]
    if isinstance(settings, dry_contact.DryContactLiftSettings):
        return WiredStory(settings)
    assert isinstance(settings, register.RegisterLiftSettings)
    return Story(
        GatewayBuilding(settings),
        floors=settings.floors,
        debounce=dict(register.debounce(settings)),
        agv_mode=settings.agv_mode,
        **msgspec.structs.asdict(settings.limits),
    )


def told(story: Story) -> list[str]:
    """Return the states that RMF heard, except the states from the ride between two floors."""
    return [words for _, words in story.states if "moving" not in words and "at ?" not in words]


def asked_until_open(story: Story, floor: str) -> None:
    """Repeat RMF's request until the door is open at this floor."""

    def there() -> bool:
        story.asks(A, floor)
        return story.state == f"AGV, open at {floor}, {A} to {floor}"

    story.until(there)


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_robot_rides_from_l1_to_l3_and_lets_go(name: str) -> None:
    story = in_service(name)
    story.run(1.0)
    asked_until_open(story, "L1")
    story.run(story.now + 3.0)
    asked_until_open(story, "L3")
    story.run(story.now + 3.0)
    story.ends(A)
    story.run(story.now + 15.0)
    assert [words for words in told(story) if "open" in words and A in words] == [
        f"AGV, open at L1, {A} to L1",
        f"AGV, open at L1, {A} to L3",
        f"AGV, open at L3, {A} to L3",
    ]
    assert (story.told[-1][1].session_id, story.state.startswith("HUMAN")) == ("", True)
    assert story.faults == []
    assert not any(relay for relay in driven(story).values())


def driven(story: Story) -> dict[str, bool]:
    """Return the last value of each relay at the lift's terminals."""
    plant = story.building.plant  # type: ignore[attr-defined]
    return {edge.signal: bool(edge.value) for edge in plant.edges if edge.what == "relay"}


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_fire_on_the_way_drops_every_relay(name: str) -> None:
    story = in_service(name)
    story.run(1.0)
    asked_until_open(story, "L1")
    story.asks(A, "L3")
    story.run(story.now + 6.0)
    assert any(driven(story).values())
    story.building.plant.press("fire_alarm", True, story.now)  # type: ignore[attr-defined]
    story.run(story.now + 0.3)
    assert not any(driven(story).values())
    assert story.state.startswith("FIRE")
