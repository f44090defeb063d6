"""A command whose transport's thread has ended hears nothing more. It must not show a silent graph as
the truth."""

from pathlib import Path

import pytest

from bridges import cli
from tests.transports.memory import MemoryNetwork, MemoryTransport

NOTIFY = "to: [{webhook: 'http://127.0.0.1:9/'}]\n"


class Ended(MemoryTransport):
    """A transport whose thread has ended."""

    @property
    def lives(self) -> bool:
        return False


@pytest.mark.parametrize(
    "words",
    [
        "exporter --listen 127.0.0.1:0",
        "watch",
        "watch --once 0.2",
        "explain --live Lift1 --for 0.2",
        "explain --live Lift1 --for 0.2 --follow",
        "judge lift Lift1 --for 0.2",
        "send lift Lift1 L1 --session fleet/a",
        "mqtt-out 127.0.0.1:9",
        "notify FILE --state STATE",
    ],
)
def test_a_command_says_that_its_transport_has_ended(
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = words.split(maxsplit=1)[0]
    name = f"workbench.commands.{command.replace('-', '_')}.open_graph"
    monkeypatch.setattr(name, lambda *_: Ended(MemoryNetwork(), command))
    (tmp_path / "notify.yaml").write_text(NOTIFY)
    typed = words.replace("FILE", str(tmp_path / "notify.yaml")).replace("STATE", str(tmp_path))
    assert cli.main(typed.split()) != 0
    assert "the transport's thread has ended" in capsys.readouterr().err
