"""Switches off a dead daemon's outputs from a new process, for `rmf-bridge outputs-off`.

A daemon writes a record of its outputs before it claims them. After the daemon's death, this record
takes precedence over the YAML, because somebody may have edited the YAML. This process does not wait
for a directory that is full, missing or read-only.
"""

import argparse
import logging
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from bridges.runtime import last_mark, signals
from bridges.runtime import runtime_directory as runtime
from bridges.runtime.holder import STATUS, STATUS_MAX
from bridges.runtime.record import ClaimRecord, Records
from bridges.runtime.switch_off import outputs_off
from bridges.settings.config import Config
from bridges.system import log
from bridges.system.directories import Directories, act_as_owner, by_hand, named, work_somewhere
from bridges.system.files import read
from bridges.system.log import pairs
from bridges.yaml.problems import SettingsError
from drivers.profiles import texts

TIMEOUT_S = 5.0


def switch_off(args: argparse.Namespace) -> int:
    """Switch the outputs off. Return 0 if every output is verified off, otherwise 1. Return 69 if the
    daemon may still be alive."""
    log.start(unhurried=True)
    signals.ignore()
    file = args.file.absolute()
    try:
        places = _places(file, args.runtime_dir)
    except PermissionError as error:
        logging.error(str(error))
        return os.EX_UNAVAILABLE
    work_somewhere(places or by_hand(file))
    if places is None:
        return _off_by_yaml(file, {})
    answered = ages(places)
    records = Records(places)
    if args.record:  # the daemon that started this process has the lock (`predecessor.py`)
        found = [r for r in records.unreleased() if r.name in args.record]
        return _off_by_records(records, found, answered)
    own = [r for r in records.unreleased() if r.file == named(file)]
    claimed = last_mark.says_claimed(os.environ) and bool(own)
    try:
        held = runtime.RuntimeDirectory(
            places, file, serves=False, wait_s=0.0 if claimed else runtime.WAIT_S
        )
    except runtime.AlreadyRunning as error:
        if claimed:
            logging.warning(
                "%s. The outputs of the earlier run are not verified off, so they are switched off now",
                error,
            )
            return _off_by_records(records, own, answered)
        logging.error("%s. The running program switches the outputs off", error)
        return os.EX_UNAVAILABLE
    try:
        return _off_by_all(held.records, file, answered)
    finally:
        held.close()


def _places(file: Path, given: str | None) -> Directories | None:
    """Return the daemon's directories. Return None if the directories cannot be trusted and systemd
    reports the daemon's death.

    Raises PermissionError if a running daemon may be in the directories.
    """
    try:
        places = runtime.find(file, given)
        act_as_owner(places)
    except PermissionError as error:
        if "SERVICE_RESULT" not in os.environ:  # systemd sets this variable for ExecStopPost
            raise
        logging.error("%s; switching off the outputs of %s", error, file)
        return None
    return places


def _off_by_all(records: Records, file: Path, answered: Mapping[str, float]) -> int:
    """Switch off the outputs of all records. If none of them is of this file, switch off the outputs of
    its YAML too."""
    found = records.unreleased()
    others = [record for record in found if record.file != named(file)]
    for other in others:
        logging.warning(pairs("record_of_another_file", record=other.name, file=other.file))
    if len(others) < len(found):
        return _off_by_records(records, found, answered)
    within_s = TIMEOUT_S / (len(found) + 1)
    code = _off_by_records(records, found, answered, within_s)
    texts.give({})  # a record's profiles are not those of the YAML
    by_yaml = _off_by_yaml(file, answered, within_s)
    return code or by_yaml


def _off_by_yaml(file: Path, answered: Mapping[str, float], within_s: float = TIMEOUT_S) -> int:
    from bridges.settings.load import load

    try:
        config = load(file)
    except SettingsError as error:
        _say(error)
        return os.EX_CONFIG
    if not config.drives:
        logging.info(pairs("nothing_to_switch_off", file=file, kind=config.kind))
        return 0
    return _told(_unsafe(config, (), answered, within_s) == set())


def _off_by_records(
    records: Records,
    found: Sequence[ClaimRecord],
    answered: Mapping[str, float],
    each_s: float | None = None,
) -> int:
    """Switch off the outputs of these records. Each record has `each_s` (s), or an equal part of
    TIMEOUT_S."""
    each_s = each_s or TIMEOUT_S / max(1, len(found))  # so one dead bus leaves time for others
    return _told(not [r for r in found if not _off_by_record(records, r, answered, each_s)])


def _off_by_record(
    records: Records, record: ClaimRecord, answered: Mapping[str, float], within_s: float
) -> bool:
    try:
        config = record.config()
    except SettingsError as error:
        _say(error)  # another version wrote the record, so use the YAML instead
        _off_by_yaml(Path(record.file), answered)
        return False
    unsafe = _unsafe(config, record.safe, answered, within_s)
    try:
        if unsafe:
            records.still_unsafe(record, unsafe, config)
        else:
            records.release(record)
    except OSError as error:
        logging.warning(pairs("not_written", what="record", reason=error))
    return not unsafe


def _unsafe(
    config: Config, safe: tuple[str, ...], answered: Mapping[str, float], within_s: float
) -> set[str]:
    return set(config.devices) - set(safe) - outputs_off(config, within_s, safe, answered)


class _Device(msgspec.Struct):
    input_age_s: float | None = None


class _StatusFile(msgspec.Struct):
    devices: dict[str, _Device] = {}


def ages(places: Directories) -> Mapping[str, float]:
    """Return the age (s) of each device's last answer, as the dead daemon's last status shows it. Leave
    out devices that never answered. Return nothing if there is no status file."""
    try:
        shown = msgspec.json.decode(read(places.runtime / STATUS, STATUS_MAX), type=_StatusFile)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return {}
    found = {name: device.input_age_s for name, device in shown.devices.items()}
    return {name: age for name, age in found.items() if age is not None}


def _told(all_off: bool) -> int:
    if all_off:
        return 0
    logging.error("outputs not verified off: cut the relays' supply before working on the device")
    return 1


def _say(error: SettingsError) -> None:
    for problem in error.problems:
        logging.error(str(problem))
