"""What the soak's daemons kept is decided again, each decision and each memory the same."""

from pathlib import Path

import pytest

from bridges.commands.replay import of_head
from bridges.recording.replayed import Cores, Replay
from bridges.recording.ring import Read
from tests.depth import depth
from tests.recording.kept import keep
from tests.site.day import Site

MB = 1_000_000


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 3])
def test_whatever_happens_at_a_site_is_decided_again_in_the_same_way(
    seed: int, tmp_path: Path
) -> None:
    site = Site(seed)
    rings = keep(site, tmp_path, 64 * MB)
    site.run(depth(6, 20) / 60)
    found = {}
    for name, ring in rings.items():
        read = Read(ring)
        replay = Replay(read.entries(), Cores(of_head(read.head)))
        assert list(replay.differences()) == []
        found[name] = (replay.course.decisions > 30, replay.course.unusable)

    assert found == dict.fromkeys(rings, (True, 0))


@pytest.mark.long
def test_a_ring_that_has_turned_many_times_begins_where_all_is_known(tmp_path: Path) -> None:
    site = Site(3)
    rings = keep(site, tmp_path, MB // 16)
    site.run(depth(8, 20) / 60)

    for name in ("Lift1", "ward", "bay1"):
        read = Read(rings[name])
        replay = Replay(read.entries(), Cores(of_head(read.head)))
        assert list(replay.differences()) == []
        assert (replay.course.subjects, replay.course.unusable) == ({name}, 0)
        assert min(read.segments) > 1
