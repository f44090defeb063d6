"""The doctor reports the end date of each certificate that a YAML names."""

import time
from pathlib import Path

import pytest

from tests.workbench.commissioning.doctor.made_up import MadeUp
from tests.workbench.commissioning.doctor.test_hardening import TLS, config
from workbench.commissioning.doctor.certificates import certificates

CA = "rmf.zenoh.tls.ca: /etc/rmf-bridges/ca.pem"
LIFT = "rmf.zenoh.tls.certificate: /etc/rmf-bridges/lift.pem"


@pytest.fixture
def made(tmp_path: Path) -> MadeUp:
    (tmp_path / "machine").mkdir()
    return MadeUp(tmp_path / "machine", installed=())


def ending(days: float) -> str:
    end = time.gmtime(time.time() + days * 86400)
    return f"            Not After : {time.strftime('%b %d %H:%M:%S %Y GMT', end)}\n"


def found(made: MadeUp) -> list[tuple[str, str]]:
    return [(one.level, one.found) for one in certificates(config(TLS), made.machine)]


def test_a_file_without_certificates_has_no_finding(made: MadeUp) -> None:
    assert [*certificates(config(), made.machine)] == []


@pytest.mark.parametrize(
    ("days", "level", "says"),
    [
        (400.5, "ok", "ends in 400 days, on "),
        (12.5, "warning", "ends in 12 days, on "),
        (-1.5, "wrong", "ended 1 day ago, on "),
    ],
)
def test_the_end_is_judged_and_told(made: MadeUp, days: float, level: str, says: str) -> None:
    for file in ("ca", "lift"):
        made.write(f"/etc/rmf-bridges/{file}.pem", "PEM")
    made.command("openssl", ending(days))
    assert [(how, text[: text.index(", on ") + 5]) for how, text in found(made)] == [
        (level, f"{CA} {says}"),
        (level, f"{LIFT} {says}"),
    ]


def test_a_missing_an_invalid_and_an_unseen_certificate_are_told_apart(made: MadeUp) -> None:
    made.write("/etc/rmf-bridges/lift.pem", "PEM")
    unseen = f"openssl does not show when {LIFT} ends"
    assert found(made) == [("wrong", f"{CA} is missing"), ("unknown", unseen)]
    made.command("openssl", "Total found: 0\n")
    invalid = f"{LIFT} cannot be read: it has no certificate"
    assert found(made) == [("wrong", f"{CA} is missing"), ("wrong", invalid)]
