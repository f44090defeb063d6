"""Examine the certificates that the YAML names, and report when they end."""

import time
from collections.abc import Iterator

from bridges.settings.config import Config
from bridges.settings.named_files import certificate_files
from bridges.system.certificates import SOON_S, CertificateEnd, first_end, listing, told
from workbench.commissioning.doctor.finding import Finding, ok, unknown, warning, wrong
from workbench.commissioning.doctor.machine import Machine

SUBJECT = "certificates"


def certificates(config: Config, machine: Machine) -> Iterator[Finding]:
    """Yield a finding for each certificate of the file."""
    now = time.time()
    for key, file in certificate_files(config).items():
        name = f"{key}: {file}"
        if not machine.at(file).is_file():
            means, do = "TLS does not work without the file", f"copy the certificate to {file}"
            yield wrong(SUBJECT, f"{name} is missing", means, do)
            continue
        shown = machine.printed(*listing(machine.at(file)))
        if shown is None:
            do = "sudo apt install openssl, and run doctor with sudo"
            yield unknown(SUBJECT, f"openssl does not show when {name} ends", do=do)
            continue
        yield _judged(name, first_end(shown), now)


def _judged(name: str, end: CertificateEnd, now: float) -> Finding:
    means = "after its end no TLS connection succeeds, and the device leaves the graph or its bus"
    do = "renew it (docs/how-to/harden.md), and restart the daemon"
    if end.at is None or end.at < now:
        return wrong(SUBJECT, told(name, end, now), means, do)
    if end.at < now + SOON_S:
        return warning(SUBJECT, told(name, end, now), means, do)
    return ok(SUBJECT, told(name, end, now))
