"""Files of other versions. A daemon reads all earlier files. The daemon reads a later file too, or
refuses the file with a reason.

`earlier/<date>` has files that the version of that day wrote. tests/blackbox/earlier has rings and
recordings.
"""

import logging
import re
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from bridges.kinds.charger_coordinator import keep as coordinator
from bridges.kinds.door_supervisor import keep as doors
from bridges.kinds.door_supervisor.settings import DoorSupervisorSettings as DoorSupervisor
from bridges.runtime.drop_in import FITS, misfit
from bridges.runtime.record import PATTERN, Records, read
from bridges.settings.load import load
from bridges.system.directories import Directories
from drivers.profiles import texts

EARLIER = sorted((Path(__file__).parent / "earlier").iterdir())
CONFIG = Path(__file__).parents[2] / "config"


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    texts.give({})
    yield
    texts.give({})


def left(folder: Path, **later: object) -> tuple[Path, Records, str]:
    """Write a record with fields of a later version. Return the record's path, the daemon's `Records`,
    and the path of the YAML."""
    (source,) = EARLIER[-1].glob(PATTERN)
    content = msgspec.json.decode(source.read_bytes()) | later
    path = folder / source.name
    path.write_bytes(msgspec.json.encode(content))
    return path, Records(Directories(folder, folder)), content["file"]


@pytest.mark.parametrize("folder", EARLIER, ids=lambda folder: folder.name)
def test_what_an_earlier_version_wrote_is_read(folder: Path) -> None:
    for path in folder.glob(PATTERN):
        record = read(path)
        assert record
        assert record.config().devices
    texts.give({})
    coordinator_yaml = load(CONFIG / "charger_coordinator.yaml").section
    kept = (folder / "charger_coordinator.json").read_bytes()
    assert coordinator.persist(coordinator.restore(kept, coordinator_yaml, 5.0)) == kept
    kept = (folder / "door_supervisor.json").read_bytes()
    assert doors.persist(doors.restore(kept, DoorSupervisor(doors=None), 5.0)) == kept


@pytest.mark.parametrize(
    "later",
    [
        {"seen_at": 17.5},
        {"claim": {"version": "9.0", "outputs": [1, 2]}},
        {"claim": "in another file", "safe": []},
    ],
    ids=str,
)
def test_a_later_versions_record_is_switched_off_by_its_yaml_and_goes_when_all_is_off(
    tmp_path: Path, later: dict[str, object]
) -> None:
    path, records, _ = left(tmp_path, **later)
    (found,) = records.unreleased()
    assert list(found.config().devices) == ["ward_door", "lab_door"]
    records.release(found)
    assert not path.exists()


def test_a_record_that_cannot_be_read_is_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, records, _ = left(tmp_path, yaml=[1])
    with caplog.at_level(logging.WARNING):
        assert records.unreleased() == []
    assert f"record_not_read path={path}" in caplog.text


def test_what_a_later_version_kept_is_refused_by_name() -> None:
    kept = msgspec.json.decode((EARLIER[-1] / "door_supervisor.json").read_bytes())
    later = msgspec.json.encode(kept | {"version": 2})
    with pytest.raises(
        ValueError, match="version 2 of a table of doors and their holders; this daemon"
    ):
        doors.restore(later, DoorSupervisor(doors=None), 5.0)
    added = msgspec.json.encode(kept | {"since": {}})
    with pytest.raises(ValueError, match=r"not a table of doors .*unknown field `since`"):
        doors.restore(added, DoorSupervisor(doors=None), 5.0)


def test_a_drop_in_of_another_version_serves_or_is_refused_by_name() -> None:
    config = load(CONFIG / "door_register.yaml")
    found = re.search(f"{FITS}=(.*)", (EARLIER[-1] / "10-enable.conf").read_text())
    assert found
    told = [misfit(config, {FITS: word}) for word in (found[1], "what a later one needs")]
    assert "run `sudo rmf-bridge enable" in told[1]
    assert told[0] in ("", told[1])
