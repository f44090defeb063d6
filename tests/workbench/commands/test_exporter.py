"""The log of the exporter. The log gives the reason why a certificate's end is unknown, because a
metric can only give numbers."""

from pathlib import Path

import pytest

from tests.system.test_certificates import certificate
from workbench.commands.exporter import Site


def test_the_reason_of_an_unknown_end_is_logged_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    file, runs = tmp_path / "page.pem", tmp_path / "runs"
    runs.mkdir()
    site = Site(runs, [str(file)])

    def scraped() -> list[str]:
        caplog.clear()
        for _ in range(2):
            [*site.collect()]
        return caplog.messages

    said = f"certificate_unreadable file={file} reason="
    assert scraped() == [f'{said}"No such file or directory"']
    certificate(file, 12)
    with monkeypatch.context() as without_openssl:
        without_openssl.setenv("PATH", str(tmp_path))
        assert scraped() == [f'{said}"openssl is not installed: sudo apt install openssl"']
    assert scraped() == []
    file.unlink()
    assert len(scraped()) == 1
