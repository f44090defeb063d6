"""The installation of the packages, and of services from YAML files."""

import grp
import time
from collections.abc import Sequence
from pathlib import Path

from tests.vm.guest import header
from tests.vm.guest.figures import pss_mb
from tests.vm.guest.rides import energise
from tests.vm.guest.system import (
    Wrong,
    back,
    enable,
    far_side,
    is_active,
    mounted,
    pid,
    ready_s,
    restarts,
    sh,
    shown,
    since_boot_s,
    unit,
    until,
)

PAGE = "rmf-bridge-page.service"
OURS = ("rmf-bridges", "rmf-bridges-workbench")
EXPOSED = 2.0
"""The highest permitted score of a unit in `systemd-analyze security`."""


def package() -> str:
    """Check that `apt install ./rmf-bridges_….deb ./rmf-bridges-workbench_….deb` works on a fresh
    Debian."""
    found = debs()
    install(*found)
    chip = (header.CONFIGFS / "bank0/chip_name").read_text().strip()
    group = grp.getgrgid(Path(f"/dev/{chip}").stat().st_gid).gr_name
    if group != "gpio":
        raise Wrong(f"/dev/{chip} belongs to the group {group}")
    return (
        f"{found[0].name}: {sh('rmf-bridge', '--version').strip()}; /dev/{chip} is the group gpio's"
    )


def install(*files: Path) -> None:
    """Install these files with apt, without questions."""
    apt = ("env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "install", "--yes")
    sh(*apt, "--no-install-recommends", *map(str, files))


def debs(folder: str = ".", names: Sequence[str] = OURS) -> list[Path]:
    """Return the package files with these names. `folder` is below the host's folder of packages, and
    `next` holds the next version."""
    there = mounted("packages", "/srv") / folder
    return [file for (file,) in (there.glob(f"{name}_*.deb") for name in names)]


def lift() -> str:
    """Check that `rmf-bridge enable lift.yaml` starts a service, which becomes ready."""
    far_side("lift")
    name = enable("lift")
    return f"ready after {ready_s(name):.2f} s"


def supervisors() -> str:
    """Check that `rmf-bridge enable` starts both of our supervisors."""
    took = [ready_s(enable(name)) for name in ("lift_supervisor", "door_supervisor")]
    return f"ready after {took[0]:.2f} and {took[1]:.2f} s"


def recorder() -> str:
    """Check that the recorder of incidents runs without any command, because the package's installation
    starts it."""
    until(lambda: is_active("rmf-bridge-recorder.service"), "the recorder is ready")
    return f"ready after {ready_s('rmf-bridge-recorder.service'):.2f} s"


def wrong_yaml() -> str:
    """Check that a service with a wrong YAML ends with exit code 78, and that systemd does not restart
    it."""
    file = Path("/etc/rmf-bridges/wrong.yaml")
    file.write_text("kind: lift\nflors: [L1]\n")
    service = unit("wrong")
    sh("systemctl", "start", service, fails=True)
    state = shown(service, "ActiveState", "ExecMainStatus")
    count = restarts(service)
    file.unlink()
    sh("systemctl", "reset-failed", service)
    if (state, count) != ({"ActiveState": "failed", "ExecMainStatus": "78"}, 0):
        raise Wrong(f"{state}, {count} restarts")
    return "exit code 78, failed, 0 restarts"


def page() -> str:
    """Install the web page, which has its own package, and start it with systemd. Check that the page
    answers and stays below its memory limit."""
    install(*debs(names=["rmf-bridges-page"]))
    began = time.monotonic()
    sh("systemctl", "start", PAGE)
    until(_answers, "the page answers")
    took = time.monotonic() - began
    memory = shown(PAGE, "MemoryPeak", "MemoryMax", "User", "NRestarts")
    peak, most = int(memory["MemoryPeak"]) / 1e6, int(memory["MemoryMax"]) / 1e6
    if peak >= most or (memory["User"], memory["NRestarts"]) != ("rmf-bridge-page", "0"):
        raise Wrong(str(memory))
    return (
        f"answers after {took:.1f} s, {pss_mb(PAGE):.0f} MB (PSS), at most {peak:.0f} of {most:.0f}"
    )


def _answers() -> bool:
    ask = "import urllib.request as u; print(u.urlopen('http://127.0.0.1:8080', timeout=30).status)"
    try:
        return sh("python3", "-c", ask).strip() == "200"
    except Wrong:
        state = shown(PAGE, "ActiveState", "ExecMainStatus")
        if state["ActiveState"] == "active":
            return False
        raise Wrong(f"the page has ended: {state}") from None


def security() -> str:
    """Check that `systemd-analyze security` gives each of our running units a score of at most 2.0. The
    unit of these tests must get more, which shows that the scores differ."""
    scores = _scores()
    units = sh("systemctl", "list-units", "--plain", "--no-legend", "rmf-bridge*.service")
    ours = {line.split()[0]: scores[line.split()[0]] for line in units.splitlines()}
    if max(ours.values()) > EXPOSED or scores["checks.service"] <= EXPOSED:
        raise Wrong(f"{ours}, and these checks {scores['checks.service']}")
    return ", ".join(f"{n.split('@')[-1].removesuffix('.service')} {s}" for n, s in ours.items())


def _scores() -> dict[str, float]:
    """Return the exposure score of each service, from 0 to 10."""
    table = (line.split() for line in sh("systemd-analyze", "security", "--no-pager").splitlines())
    return {words[0]: float(words[1]) for words in table if words and ".service" in words[0]}


def upgrade() -> str:
    """Install the next version while two relays are on. Check that the relays go off and stay off, and
    that the service returns."""
    service = unit("lift")
    relays, old = energise(), pid(service)
    when = header.now()
    install(*debs("next"))
    back(service, old)
    version = sh("dpkg-query", "-W", "-f", "${Version}", "rmf-bridges")
    off = header.off_at(relays, when)
    if off.keys() != relays.keys() or header.on(relays, when) or not version.endswith(".1"):
        raise Wrong(f"{version}: relays {sorted(relays)}, off {off}, on {header.on(relays, when)}")
    down_s = since_boot_s(service, "ActiveEnterTimestampMonotonic") - max(off.values())
    return f"{version}: relays off, the service is back after {down_s:.1f} s"
