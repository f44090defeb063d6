"""The coordinator's memory after a restart, and the stored entries that the coordinator does not
trust."""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger_coordinator import keep
from bridges.kinds.charger_coordinator.memory import (
    CHARGING,
    ERROR,
)
from bridges.kinds.charger_coordinator.signals import (
    ChargeUnwanted,
    ChargeWanted,
    Dedicated,
)
from tests.kinds.charger_coordinator.alone import ONE, SETTINGS, THREE, TWO, A, Alone, B
from tests.kinds.charger_coordinator.virtual_site import settings


def test_a_restart_remembers_the_charging_robots_and_the_pending_releases() -> None:
    site_ = Alone()
    site_.wants(ONE)
    site_.wants(TWO)
    site_.run(1)
    site_.does(A, CHARGING)
    site_.does(B, CHARGING)
    site_.run(1)
    site_.seen[TWO] = replace(site_.seen[TWO], charges=False)
    site_.run(1)
    kept = keep.persist({"site": site_.memory})
    restored = keep.restore(kept, SETTINGS, 50.0)["site"].grants
    assert {name: (g.robot, g.started, g.over) for name, g in restored.items()} == {
        A: (ONE, True, False),
        B: (TWO, True, True),
    }


def test_names_that_are_missing_in_the_yaml_are_not_restored() -> None:
    site_ = Alone()
    for who in (ONE, TWO, THREE):
        site_.wants(who)
    site_.run(1)
    kept = keep.persist({"site": site_.memory})
    fleet = SETTINGS.fleets["tiny"]
    less = {name: robot for name, robot in fleet.robots.items() if name != "AMR01"}
    changed = settings(
        fleets={"tiny": type(fleet)(waypoints=fleet.waypoints, robots=less)},
        stations={"charger_b": SETTINGS.stations["charger_b"]},
    )
    restored = keep.restore(kept, changed, 9.0)["site"]
    assert [wish.robot for wish in restored.wishes] == [TWO, THREE]
    assert {name: grant.robot for name, grant in restored.grants.items()} == {B: TWO}
    with pytest.raises(ValueError, match="version 7"):
        keep.restore(kept.replace(b'"version":1', b'"version":7'), SETTINGS, 0.0)


def test_a_restart_remembers_everything_that_it_keeps() -> None:
    site_ = Alone()
    site_.hears(Dedicated(((TWO, B),)))
    site_.wants(ONE)
    site_.run(1)
    site_.does(A, ERROR, "over temperature")
    site_.run(1)
    site_.hears(ChargeWanted(TWO, B, "op-1", 33.0))
    site_.hears(ChargeUnwanted("op-1"))
    site_.hears(ChargeWanted(TWO, A, "op-2", 44.0))
    site_.wants(THREE)
    site_.run(1)
    wishes = tuple(replace(wish, called=wish.robot == THREE) for wish in site_.memory.wishes)
    before = replace(
        site_.memory, wishes=wishes, served={THREE: "task of AMR03"}, reached={TWO: 95.0}
    )
    after = keep.restore(keep.persist({"site": before}), SETTINGS, 50.0)["site"]
    assert (after.wishes, after.strikes, after.served) == (
        before.wishes,
        before.strikes,
        before.served,
    )
    assert (after.over, after.count, after.preferred) == (
        before.over,
        before.count,
        before.preferred,
    )
    assert after.reached == {TWO: 95.0}
    assert (before.strikes, before.over, before.preferred) == ({ONE: (A,)}, ("op-1",), {TWO: B})
    for name, grant in before.grants.items():
        kept = after.grants[name]
        assert (kept.robot, kept.request_id, kept.start_timeout_s, kept.made_at) == (
            grant.robot,
            grant.request_id,
            grant.start_timeout_s,
            50.0,
        )
    assert after.began_at == 50.0


def test_a_memory_of_an_earlier_version_has_no_reached_percentages_and_is_restored() -> None:
    kept = keep.persist({})
    assert b"reached" not in kept
    assert keep.restore(kept, SETTINGS, 0.0)["site"].reached == {}


def test_a_coordinator_that_remembers_nothing_keeps_an_empty_memory() -> None:
    kept = keep.restore(keep.persist({}), SETTINGS, 0.0)["site"]
    assert (kept.wishes, dict(kept.grants), kept.count) == ((), {}, 0)


def test_a_file_that_is_no_memory_is_refused_with_the_expected_form() -> None:
    with pytest.raises(ValueError, match=r"^not a coordinator's memory: "):
        keep.restore(b"[]", SETTINGS, 0.0)
