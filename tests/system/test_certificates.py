"""The expiry times of real certificates, which the real openssl reads."""

import os
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import trustme

from bridges.system.certificates import DAY_S, CertificateEnd, CertificateReader, told

NOW = time.time()


def certificate(file: Path, *days: float) -> str:
    """Write a file of certificates, one for each number of days until its expiry. Return the file's
    path."""
    file.unlink(missing_ok=True)
    for each in days:
        end = datetime.fromtimestamp(NOW, UTC) + timedelta(days=each)
        begin = datetime.fromtimestamp(NOW, UTC) - timedelta(days=400)
        leaf = trustme.CA().issue_cert("lift", not_before=begin, not_after=end)
        leaf.cert_chain_pems[0].write_to_path(str(file), append=True)
    return str(file)


@pytest.mark.parametrize(
    ("days", "says"),
    [
        ((12.5,), "lift.pem ends in 12 days, on "),
        ((400, 1.5), "lift.pem ends in 1 day, on "),
        ((0.2,), "lift.pem ends in 4 h, on "),
        ((-3.5,), "lift.pem ended 3 days ago, on "),
    ],
)
def test_the_first_end_in_a_file_is_told(
    tmp_path: Path, days: tuple[float, ...], says: str
) -> None:
    end = CertificateReader().end(certificate(tmp_path / "lift.pem", *days))
    assert end.at == pytest.approx(NOW + min(days) * DAY_S, abs=2)
    assert told("lift.pem", end, NOW).startswith(says)


def test_an_end_that_cannot_be_read_is_unknown_and_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader, file = CertificateReader(), tmp_path / "ca.pem"
    assert reader.end(str(file)) == CertificateEnd(None, "No such file or directory")
    file.write_text("garbage")
    assert reader.end(str(file)) == CertificateEnd(None, "it has no certificate")
    file.write_bytes(bytes(2 << 20))
    assert reader.end(str(file)) == CertificateEnd(None, "it is larger than 1048576 bytes")
    certificate(file, 5)
    monkeypatch.setenv("PATH", str(tmp_path))
    missing = CertificateEnd(None, "openssl is not installed: sudo apt install openssl")
    assert reader.end(str(file)) == missing
    assert told("rmf.zenoh.tls.ca", missing, NOW).startswith("rmf.zenoh.tls.ca cannot be read: op")


def test_a_renewed_file_is_read_again_and_the_same_file_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader = CertificateReader()
    file = certificate(tmp_path / "lift.pem", 2)
    first = reader.end(file)
    path = os.environ["PATH"]
    monkeypatch.setenv("PATH", str(tmp_path))
    assert reader.end(file) == first
    monkeypatch.setenv("PATH", path)
    certificate(tmp_path / "new.pem", 800)
    (tmp_path / "new.pem").rename(file)
    assert (reader.end(file).at or 0) > NOW + 700 * DAY_S
