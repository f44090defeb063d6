"""The troubles that `notify` reports about certificates. The tests check the kind, severity and text of
each trouble."""

import pytest

from bridges.system.certificates import DAY_S, CertificateEnd
from workbench.notify.troubles import of_certificates

NOW = 1_800_000_000.0
ENDS, GONE = "/e/lift.pem", "No such file or directory"


@pytest.mark.parametrize(
    ("end", "wanted"),
    [
        (CertificateEnd(NOW + 31 * DAY_S), []),
        (
            CertificateEnd(NOW + 12.5 * DAY_S),
            [("EXPIRES", "warning", 0, "ends in 12 days, on 2027-01-27")],
        ),
        (
            CertificateEnd(NOW + 6.5 * DAY_S),
            [("EXPIRES", "warning", 1, "ends in 6 days, on 2027-01-21")],
        ),
        (
            CertificateEnd(NOW - 2.5 * DAY_S),
            [("EXPIRES", "critical", 2, "ended 2 days ago, on 2027-01-12")],
        ),
        (CertificateEnd(None, GONE), [("UNREADABLE", "warning", 0, f"cannot be read: {GONE}")]),
    ],
)
def test_an_expiry_is_told_a_month_and_a_week_before_it_and_is_critical_afterwards(
    end: CertificateEnd, wanted: list[tuple[str, str, int, str]]
) -> None:
    key = "rmf.zenoh.tls.certificate"
    found = of_certificates([("lift", key, ENDS)], lambda _: end, NOW)
    assert [(one.what, one.severity, one.stage, one.headline) for one in found] == [
        (
            f"CERTIFICATE_{what} {key} {ENDS}",
            severity,
            stage,
            f"certificate {ENDS} (lift, {key}) {text}",
        )
        for what, severity, stage, text in wanted
    ]
