"""A record of claimed outputs. The record has all data that a process needs to switch off, even if
files on the disk change later."""

import errno
from collections.abc import Iterator
from pathlib import Path
from threading import Event

import pytest

from bridges.runtime import record
from bridges.runtime.predecessor import Predecessor, SafeFirst
from bridges.runtime.record import ClaimRecord, Records
from bridges.settings.load import SettingsError, load
from bridges.system.directories import Directories
from drivers import DriverError
from drivers.charger import can_frames, dbc
from drivers.profiles import texts

CONFIG = Path(__file__).parents[2] / "config"


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    texts.give({})
    yield
    texts.give({})


def test_the_record_of_a_charger_has_its_profile_and_its_dbc() -> None:
    written = record.of(load(CONFIG / "charger_wiferion.yaml"))
    assert sorted(written.texts) == ["wiferion.dbc", "wiferion.yaml"]
    assert written.texts["wiferion.dbc"] == (texts.FOLDER / "wiferion.dbc").read_bytes()


def test_a_claim_is_read_as_it_was_recorded_and_not_as_the_disk_has_it_now() -> None:
    file = CONFIG / "charger_wiferion.yaml"
    written = record.of(load(file))
    profile = written.texts["wiferion.yaml"].replace(b"dbc: wiferion.dbc", b"dbc: gone.dbc")
    older = {"wiferion.yaml": profile, "gone.dbc": written.texts["wiferion.dbc"]}
    found = ClaimRecord(written.file, written.yaml, older).config()
    (settings,) = found.devices.values()
    assert can_frames.frame_map(settings).dbc == "gone.dbc"
    assert dbc.load("gone.dbc").frames() == dbc.Dbc(written.texts["wiferion.dbc"].decode()).frames()
    texts.give({})
    (as_it_is_now,) = load(file).devices.values()
    assert can_frames.frame_map(as_it_is_now).dbc == "wiferion.dbc"


def test_a_profile_that_is_gone_from_the_disk_is_found_in_the_record() -> None:
    written = record.of(load(CONFIG / "door_register.yaml"))
    renamed = ClaimRecord(
        written.file,
        written.yaml.replace(b"profile: generic-register-door", b"profile: no-more"),
        {"no-more.yaml": written.texts["generic-register-door.yaml"]},
    )
    assert list(renamed.config().devices) == list(written.config().devices)
    texts.give({})
    with pytest.raises(SettingsError, match="unknown profile 'no-more'"):
        ClaimRecord(renamed.file, renamed.yaml, {}).config()


class Silent:
    """A device that answers from the third try on."""

    def __init__(self) -> None:
        self.called: list[str] = []

    def open(self) -> None:
        self.called.append("open")
        if self.called.count("open") < 3:
            raise DriverError("no reply")

    def read(self) -> None:
        self.called.append("read")

    def write(self, outputs: object) -> None:
        self.called.append("write")

    def make_safe(self) -> None:
        self.called.append("make_safe")

    def close(self) -> None:
        self.called.append("close")


def test_a_device_that_a_dead_daemon_left_on_is_made_safe_once_as_soon_as_it_answers() -> None:
    silent = Silent()
    driver = SafeFirst("station", silent)
    for _ in range(2):
        with pytest.raises(DriverError):
            driver.open()
    driver.open()
    driver.read()
    driver.open()
    assert silent.called == ["open", "open", "open", "make_safe", "read", "open"]


@pytest.mark.parametrize("tried", [True, False])
def test_a_start_has_another_process_switch_off_its_own_devices_unless_one_just_has_tried(
    tmp_path: Path, tried: bool
) -> None:
    places = Directories(tmp_path / "run", tmp_path / "state")
    places.runtime.mkdir()
    config = load(CONFIG / "door_register.yaml")
    ours = record.of(config)
    records = Records(places)
    records.write(ours)
    if tried:
        records.still_unsafe(ours, config.devices, config)
    started = tmp_path / "started"
    predecessor = Predecessor(records, ours, ["sh", "-c", f"touch {started}", "outputs-off"])
    assert predecessor.make_safe(Event().wait) == set(config.devices)
    assert (predecessor.left(), started.exists()) == ([], not tried)


TWO_DOORS = """\
kind: door
driver: dry_contact
rmf: {transport: dds}
buses: {module: {type: modbus, tcp: {host: 127.0.0.1, port: 502}}}
doors:
""" + "".join(
    f"""\
  {name}:
    inputs:
      opened: {{point: unit 1 discrete input {at}, active: high}}
      closed: {{point: unit 1 discrete input {at + 2}, active: high}}
    outputs: {{hold_open: {{point: unit 1 coil {at}, active: high}}}}
"""
    for at, name in enumerate("ab")
)


def one_off_on_a_worn_card(folder: Path) -> tuple[Records, ClaimRecord, Directories]:
    """Return the records of a dead daemon whose state directory cannot be written any more. After its
    death `outputs-off` has switched off only door b."""
    file = folder / "doors.yaml"
    file.write_text(TWO_DOORS)
    config = load(file)
    places = Directories(folder / "run", folder / "state")
    places.runtime.mkdir()
    records, claimed = Records(places), record.of(config)
    records.write(claimed)
    (places.state / f".{claimed.name}.new").mkdir()
    records.still_unsafe(claimed, ["a"], config)
    (found,) = records.unreleased()
    assert (found.safe, (places.state / claimed.name).exists()) == (("b",), True)
    return records, claimed, places


def test_a_device_that_was_off_after_one_death_is_switched_off_after_the_next_too(
    tmp_path: Path,
) -> None:
    records, claimed, places = one_off_on_a_worn_card(tmp_path)
    records.write(claimed)  # the next daemon claims both doors
    assert records.unreleased() == [claimed]
    assert list(places.runtime.glob(record.PATTERN)) == []


def test_a_record_that_cannot_be_removed_switches_no_device_off_again_until_it_is_claimed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    records, claimed, places = one_off_on_a_worn_card(tmp_path)
    unlink = Path.unlink

    def refused(path: Path, missing_ok: bool = False) -> None:
        if path.parent == places.state:
            raise OSError(errno.EROFS, "Read-only file system", str(path))
        unlink(path, missing_ok=missing_ok)

    monkeypatch.setattr(Path, "unlink", refused)
    records.release(claimed)
    assert (records.unreleased(), (places.state / claimed.name).exists()) == ([], True)
    records.write(claimed)
    assert records.unreleased() == [claimed]
