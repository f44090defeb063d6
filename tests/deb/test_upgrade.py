"""Installing, upgrading, going back and removing, by the real dpkg: whatever ends it, one version is whole, and serves."""

import shutil
from pathlib import Path

import pytest

from tests.deb.small import System, package

pytestmark = pytest.mark.skipif(shutil.which("dpkg") is None, reason="dpkg is Debian's")

OLD, ONE, TWO = "0.1.0+deb13", "0.1.0+r1.ga", "0.1.0+r2.gb"
MODULES = {OLD: ("module_a", "module_old"), ONE: ("module_a", "module_b"), TWO: ("module_b", "module_c")}
SERVED = {"door": "active", "failed": "active", "stopped": "inactive"}


@pytest.fixture(scope="module")
def debs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("packages")
    return {v: package(folder, v, names, old=v == OLD) for v, names in MODULES.items()}


def whole(version: str) -> str:
    return " ".join((version, *MODULES[version]))


def system(folder: Path, deb: Path) -> System:
    """A machine with this package and services: one serves, one has failed, somebody has stopped one."""
    made = System(folder)
    assert made.dpkg("-i", deb).returncode == 0
    for name, state in (("door", "active"), ("failed", "failed"), ("stopped", "inactive")):
        made.service(name, state)
    return made


def is_complete(made: System, version: str) -> bool:
    drop_ins = [made.drop_in(name) for name in made.states()]
    assert made.status() == f"ii {version}"
    assert made.off() == whole(version)
    assert made.states() == SERVED
    assert [f.read_text() for f in drop_ins] == [f"drop-in of {version}\n"] * len(drop_ins)
    assert not [f for f in drop_ins if f.is_symlink() or len(list(f.parent.iterdir())) != 1]
    assert made.trees() == [f"{version}-1"]
    return True


@pytest.mark.parametrize(("before", "after"), [(OLD, ONE), (ONE, TWO), (TWO, ONE)])
def test_an_upgrade_or_a_downgrade_serves_on_with_all_that_served_before(
    tmp_path: Path, debs: dict[str, Path], before: str, after: str
) -> None:
    made = system(tmp_path, debs[before])
    told = made.dpkg("-i", debs[after])
    assert told.returncode == 0
    assert is_complete(made, after), told


@pytest.mark.parametrize(("before", "after"), [(OLD, ONE), (ONE, TWO)])
@pytest.mark.long(120)
def test_whenever_the_power_is_cut_one_version_is_whole_and_dpkg_completes_the_other(
    tmp_path: Path, debs: dict[str, Path], before: str, after: str
) -> None:
    first = system(tmp_path / "0", debs[before])
    first.dpkg("-i", debs[after])
    for cut in range(1, first.counted() + 1):
        made = system(tmp_path / str(cut), debs[before])
        made.dpkg("-i", debs[after], cut=cut)
        now = made.off()
        assert now in (whole(before), whole(after)), cut
        if now == whole(after) or made.drop_in("door").is_symlink():
            assert made.drop_in("door").read_text() == f"drop-in of {now.split()[0]}\n" or before == OLD
        if made.status()[1] == "H":  # dpkg had not unpacked it: it wants the file again
            made.dpkg("-i", debs[after])
        else:
            made.dpkg("--configure", "-a")
        assert is_complete(made, after), cut
