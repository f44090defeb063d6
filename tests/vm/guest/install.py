"""The package, and services made of YAMLs."""

import grp
from pathlib import Path

from tests.vm.guest import header
from tests.vm.guest.system import (
    Wrong,
    enable,
    far_side,
    is_active,
    ready_s,
    restarts,
    sh,
    shown,
    unit,
    until,
)


def package() -> str:
    """`apt install ./rmf-bridges_….deb` on a fresh Debian."""
    deb = _deb()
    apt = ("env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "install", "--yes")
    sh(*apt, "--no-install-recommends", str(deb))
    chip = (header.CONFIGFS / "bank0/chip_name").read_text().strip()
    group = grp.getgrgid(Path(f"/dev/{chip}").stat().st_gid).gr_name
    if group != "gpio":
        raise Wrong(f"/dev/{chip} belongs to the group {group}")
    return f"{deb.name}: {sh('rmf-bridge', '--version').strip()}; /dev/{chip} is the group gpio's"


def _deb() -> Path:
    """The daemons' package, which the host shares."""
    if not Path("/srv").is_mount():
        sh("mount", "-t", "9p", "-o", "ro,trans=virtio,version=9p2000.L", "packages", "/srv")
    (deb,) = Path("/srv").glob("rmf-bridges_*.deb")
    return deb


def lift() -> str:
    """`rmf-bridge enable lift.yaml`: the service starts, and is ready."""
    far_side("lift")
    name = enable("lift")
    return f"ready after {ready_s(name):.2f} s"


def supervisors() -> str:
    """`rmf-bridge enable` for RMF's two supervisors."""
    took = [ready_s(enable(name)) for name in ("lift_supervisor", "door_supervisor")]
    return f"ready after {took[0]:.2f} and {took[1]:.2f} s"


def recorder() -> str:
    """The recorder of incidents runs since the package was installed."""
    until(lambda: is_active("rmf-bridge-recorder.service"), "the recorder is ready")
    return f"ready after {ready_s('rmf-bridge-recorder.service'):.2f} s"


def wrong_yaml() -> str:
    """A YAML that cannot be right: exit code 78, and no restart."""
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
