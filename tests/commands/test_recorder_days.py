"""`rmf-bridge recorder --days`: the folder whose counts it prints."""

import os
from pathlib import Path

import pytest

from bridges import cli
from bridges.blackbox import days
from bridges.commands import recorder


def test_the_counts_are_those_of_the_service_if_there_is_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    service, read = tmp_path / "service", list[Path]()
    monkeypatch.setattr(recorder, "SERVICE", service)

    def counts(folder: Path) -> days.Days:
        read.append(folder)
        return {}

    monkeypatch.setattr(days, "read", counts)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert cli.main(["recorder", "--days"]) == 0
    service.mkdir()
    assert cli.main(["recorder", "--days"]) == 0
    assert cli.main(["recorder", "--days", "-o", str(tmp_path)]) == 0
    assert read == [tmp_path / "rmf-bridge" / "recordings", service, tmp_path]
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert cli.main(["recorder", "--days"]) == os.EX_NOPERM
    assert "with sudo" in capsys.readouterr().err
