"""A short day at the site for a few random seeds. `make soak` plays whole days."""

from pathlib import Path
from random import Random
from typing import Any

import pytest

from bridges.kinds.lift import forgotten
from bridges.messages import definitions as d
from bridges.messages.topics import DOOR_REQUESTS, DOOR_STATES, LIFT_STATES, Topic
from tests.depth import depth
from tests.site.building import hospital
from tests.site.daemons import DeviceDaemon, rmfs_door_supervisor
from tests.site.day import Site
from tests.site.growth import Look, growth
from tests.site.laws import Broken, Laws
from tests.site.network import CLEAR, Air, Place
from tests.site.saved import OtherCode, load, save
from tests.site.timeline import Timeline

SEEDS = depth([2], [1, 2, 3])
"""The seeds of the days. They differ in the kind of supervisors. tests/workbench/replay/test_replay.py
also runs seeds 1 and 3."""
MINUTES = depth(8, 20)
"""The length of a day (min). It exceeds WIND_DOWN_S, the time in which the robots go home."""


@pytest.mark.long(5)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_site_survives_its_troubles(seed: int) -> None:
    """After a failure, `make soak SEED=… HOURS=0.3333` runs the day again and prints the last events
    before the failure.

    The seed chooses our supervisors, or RMF's supervisors of the release Kilted or Jazzy.
    """
    site = Site(seed)
    site.run(MINUTES / 60)
    done = site.counts()
    assert done["rides"] > depth(4, 20)
    assert done["doors"] > depth(8, 40)
    assert sum(site.trouble.counts.values()) > depth(1, 5)
    assert done["dispensings"] == 1
    assert done["drills and alarms"] >= depth(2, 7)


def test_nodes_that_were_once_cut_off_hear_each_other_as_late_as_before() -> None:
    timeline = Timeline()
    air = Air(timeline, Random(1))
    for name, until in (("lift", 5.0), ("supervisor", 30.0), ("supervisor", 20.0)):
        air.cut_off(name, until)
    timeline.run(4.0)
    assert air.delays("lift", "supervisor", LIFT_STATES) == ()  # the cut lasts longer than a lease
    timeline.run(3600.0)
    delays = [d for _ in range(500) for d in air.delays("lift", "supervisor", LIFT_STATES)]
    assert min(delays) >= 0.002
    assert max(delays) > 0.5


def test_what_rmfs_supervisors_say_once_is_late_but_never_lost() -> None:
    timeline = Timeline()
    air = Air(timeline, Random(1))
    rmfs_door_supervisor(timeline, air)
    sent = [air.delays("rmf_door_supervisor", "door", DOOR_REQUESTS) for _ in range(2000)]
    assert min(len(copies) for copies in sent) == 1
    assert max(max(copies) for copies in sent) >= air.weather.latest_s
    assert () in [air.delays("door_supervisor", "door", DOOR_REQUESTS) for _ in range(2000)]


def test_a_robot_in_a_hospital_hears_its_door_and_then_the_next_other_one() -> None:
    """RMF's DoorOpen looks at the latest state of any door."""
    timeline = Timeline()
    air = Air(timeline, Random(1))
    air.sorts, air.weather = True, CLEAR
    heard = list[str]()
    robot = Place(air, "fleet/red", lambda: None, choosy=True)
    robot.subscribe(DOOR_STATES, lambda state: heard.append(state.door_name))
    doors = Place(air, "doors", lambda: None).publisher(DOOR_STATES)

    def told(*names: str) -> list[str]:
        heard.clear()
        for name in names:
            doors.publish(d.DoorState(door_name=name))
            timeline.run(timeline.now + 1.0)
        return list(heard)

    assert told("ward", "lab") == []
    robot.heed(frozenset({(DOOR_STATES.name, "ward")}))
    assert told("lab", "ward", "lab", "store", "ward") == ["ward", "lab", "ward"]
    robot.heed(frozenset({(DOOR_STATES.name, "")}))
    assert told("lab", "ward", "lab") == ["lab", "ward", "lab"]
    robot.close()
    assert told("ward", "lab") == []


@pytest.mark.long(3)
def test_a_hospital_whose_network_sorts_survives_its_troubles(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In a hospital each device gets the messages that name it, and no others."""
    heard: set[tuple[str, str]] = set()
    hear = DeviceDaemon._hear

    def hears(daemon: DeviceDaemon, topic: Topic[Any], message: Any) -> None:
        heard.add((daemon.name, daemon.device.kind.device_name(message)))
        hear(daemon, topic, message)

    monkeypatch.setattr(DeviceDaemon, "_hear", hears)
    site = Site(4, "ours", size=hospital(3, 6, 3, 8))
    site.run(depth(8, 60) / 60)
    assert {name for name, named in heard if named != name} == set()
    assert {name for name, _ in heard} >= {*site.size.lifts, *site.size.doors}
    assert site.counts()["rides"] > depth(4, 40)


@pytest.mark.long(3)
def test_without_our_remedy_a_forgotten_robot_blocks_a_lift_for_ever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """This day contains the deadlock that `bridges/kinds/lift/forgotten.py` ends."""
    monkeypatch.setattr(forgotten, "heard", lambda session, asked, now: (session, False))
    site = Site(25, "kilted")  # a day with an early deadlock
    site.trouble._draw = site._restart_rmfs
    with pytest.raises(Broken, match=r"has waited for Lift\d"):
        site.run(0.5)


@pytest.mark.long(5)
@pytest.mark.parametrize("rmf", depth(["jazzy"], ["jazzy", "kilted"]))
def test_no_other_robot_gets_an_occupied_car_if_the_supervisor_dies_every_27_s(
    rmf: str,
) -> None:
    """To run the same day with two hundred kills: `make soak RMF=jazzy KILL_EVERY=27 HOURS=1.65
    SEED=3`."""
    site = Site(3, rmf, kill_every_s=27.0)
    site.run(depth(12, 60) / 60)
    assert site.kills["of them with a robot in a car"] > depth(4, 60)


@pytest.mark.long(2)
def test_the_same_seed_gives_the_same_day() -> None:
    days = [Site(5), Site(5)]
    for day in days:
        day.run(depth(0.03, 0.15))
    assert days[0].counts() == days[1].counts()
    assert list(days[0].laws.log) == list(days[1].laws.log)


@pytest.mark.long(3)
def test_a_saved_site_goes_on_as_if_it_had_not_been_saved(tmp_path: Path) -> None:
    site, hours = Site(4, "ours", size=hospital(1, 2, 1, 2)), depth(0.12, 0.4)
    site.run(hours)
    save(site, tmp_path / "site")
    days = [site, load(tmp_path / "site")]
    for day in days:
        day.run(hours)
    assert days[0].counts() == days[1].counts()
    assert list(days[0].laws.log) == list(days[1].laws.log)
    assert days[0].counts()["rides"] > 2


def test_a_site_that_other_code_has_saved_does_not_go_on(tmp_path: Path) -> None:
    save(Site(4, size=hospital(1, 1, 1, 1)), tmp_path / "site")
    kept = (tmp_path / "site").read_bytes()
    (tmp_path / "site").write_bytes(bytes([kept[0] ^ 1]) + kept[1:])
    with pytest.raises(OtherCode, match="saved by another version"):
        load(tmp_path / "site")


def test_growth_from_hour_to_hour_is_reported() -> None:
    flat = [Look(hour, 1, 6, 33_000 + 100 * (hour % 2), 34.0) for hour in range(1, 6)]
    assert growth(flat) == []
    assert growth([*flat, Look(6, 2, 9, 39_000, 60.0)]) == [
        "threads: 1 to 2",
        "descriptors: 6 to 9",
        "objects: 33000 to 39000",
        "memory: 34.0 to 60.0 MB",
    ]


def test_a_law_that_is_broken_in_the_middle_of_a_drivers_call_ends_the_day(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A daemon catches each Exception of its driver. A broken law of a relay is raised inside the
    driver's `write`, but must still end the day."""
    monkeypatch.setattr(
        Laws, "_lift_relay", lambda laws, name, edge: laws.require(False, f"{edge.signal} moves")
    )
    with pytest.raises(Broken, match="moves"):
        Site(6, "ours").run(0.3)


def test_a_defect_that_a_daemon_contains_ends_the_day(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(driver: object) -> None:
        raise ZeroDivisionError

    site = Site(6, "ours")
    of_lift1 = type(site.devices["Lift1"].driver())
    site.timeline.at(60.0, lambda: monkeypatch.setattr(of_lift1, "read", fails))
    with pytest.raises(Broken, match="a defect of the driver: ZeroDivisionError"):
        site.run(0.3)
