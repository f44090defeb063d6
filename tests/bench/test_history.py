"""The bench's table of promised figures, and its history."""

from pathlib import Path
from typing import Any

import pytest

from bench import __main__ as bench
from bench.history import keep, losses, table


def figures(cpu: float, machine: str = "a Pi", commit: str = "abc") -> dict[str, Any]:
    doors = {"doors on one gateway": {"200": {"CPU %": cpu}}}
    return {
        "machine": machine, "date": "d", "host": "h", "commit": commit, "idle": doors,
    }  # fmt: skip


def test_only_measured_figures_are_in_the_table() -> None:
    heading, line = table(figures(25.0))
    assert (heading.split(), line.split()) == (
        ["promised", "aim", "seen"],
        ["CPU", "in", "%", "of", "200", "doors", "15", "25.00"],
    )


def test_a_loss_is_told_against_the_best_run_on_a_like_machine(tmp_path: Path) -> None:
    assert list(losses(figures(99.0), tmp_path)) == []
    keep(figures(20.0, commit="first"), tmp_path)
    keep(figures(22.0, commit="second"), tmp_path)
    keep(figures(1.0, machine="another"), tmp_path)
    assert list(losses(figures(22.9), tmp_path)) == []
    assert list(losses(figures(23.1), tmp_path)) == [
        "LOSS: CPU in % of 200 doors was 20.00 at first, and is 23.10"
    ]


def test_a_busy_machine_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("os.getloadavg", lambda: (1.2, 0.0, 0.0))
    assert bench.main(["idle"]) == 75
    assert "the load is 1.2" in capsys.readouterr().out
