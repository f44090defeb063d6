"""Upgrades with the real dpkg. After any interruption one whole version is in service."""

import shutil
from pathlib import Path

import pytest

from tests.deb.small import System, package
from tests.depth import part

pytestmark = pytest.mark.skipif(shutil.which("dpkg") is None, reason="dpkg is Debian's")

OLD, ONE, TWO = "0.1.0+deb13", "0.1.0+r1.ga", "0.1.0+r2.gb"
MODULES = {
    OLD: ("module_a", "module_old"),
    ONE: ("module_a", "module_b"),
    TWO: ("module_b", "module_c"),
}
SERVED = {"door": "active", "failed": "active", "stopped": "inactive"}


@pytest.fixture(scope="module")
def debs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("packages")
    return {v: package(folder, v, names, old=v == OLD) for v, names in MODULES.items()}


def whole(version: str) -> str:
    return " ".join((version, *MODULES[version]))


def system(folder: Path, deb: Path) -> System:
    """Return a machine with this package and three services. One service is active, one has failed, and
    a person has stopped the third."""
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
    (tree,) = made.trees()
    assert tree.rpartition("-")[0] == version
    return True


@pytest.mark.parametrize(("before", "after"), [(OLD, ONE), (ONE, TWO), (TWO, ONE)])
def test_after_an_upgrade_or_downgrade_all_earlier_services_run(
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
    machine, image = tmp_path / "machine", tmp_path / "image"
    made = system(machine, debs[before])
    shutil.copytree(machine, image, symlinks=True)
    made.dpkg("-i", debs[after])
    for cut in part(range(1, made.counted() + 1), 5, first=2 * (before == OLD)):
        shutil.rmtree(machine)
        shutil.copytree(image, machine, symlinks=True)
        made.dpkg("-i", debs[after], cut=cut)
        now = made.off()
        assert now in (whole(before), whole(after)), cut
        fits = "nothing" if now == whole(before) else after
        assert made.drop_in("door").read_text() == f"drop-in of {fits}\n", cut
        if made.status()[1] == "H":  # dpkg has not unpacked the package, so it needs the file again
            made.dpkg("-i", debs[after])
        else:
            made.dpkg("--configure", "-a")
        assert is_complete(made, after), cut


def test_a_file_that_the_new_version_refuses_leaves_everything_as_it_was(
    tmp_path: Path, debs: dict[str, Path]
) -> None:
    made = system(tmp_path, debs[ONE])
    yaml = made.root / "etc/rmf-bridges/door.yaml"
    yaml.write_text(f"# refused by {TWO}\n")
    states = made.states()
    told = made.dpkg("-i", debs[TWO])
    assert (told.returncode, f"{yaml}:1:1: refused\n" in told.stderr) == (1, True)
    assert (made.status(), made.off(), made.states()) == (f"iF {TWO}", whole(ONE), states)
    assert (made.trees(), made.drop_in("door").read_text()) == (
        [f"{ONE}-1"],
        "drop-in of nothing\n",
    )
    assert "stop" not in made.called()
    yaml.write_text("mended\n")
    made.dpkg("--configure", "-a")
    assert is_complete(made, TWO)


def left_on(made: System) -> str:
    """Leave a record of the door's outputs. Return the line that the package's scripts must print."""
    record = made.root / "var/lib/rmf-bridge/door/claimed-1.json"
    record.parent.mkdir()
    record.touch()
    return f"door: not verified off: cut its relays' supply before anybody works on it ({record})\n"


def test_a_failed_service_and_an_unverified_output_are_named_and_the_others_serve(
    tmp_path: Path, debs: dict[str, Path]
) -> None:
    made = system(tmp_path, debs[ONE])
    told_of = left_on(made)
    (made.fakes / "absent/rmf-bridge@failed.service").touch()
    told = made.dpkg("-i", debs[TWO])
    assert told.returncode == 0
    assert told_of in told.stderr
    assert "rmf-bridge@failed.service does not serve" in told.stderr
    assert made.states() == {**SERVED, "failed": "failed"}
    # The old version's tree stays until every service has served.
    assert (made.off(), len(made.trees())) == (whole(TWO), 2)


@pytest.mark.parametrize("step", ["nice", "sync", "ln", "mv"])
def test_a_full_disk_at_any_step_leaves_every_service_running(
    tmp_path: Path, debs: dict[str, Path], step: str
) -> None:
    made = system(tmp_path, debs[ONE])
    real = made.fails(step)
    told = made.dpkg("-i", debs[TWO])
    assert (told.returncode, made.status()) == (1, f"iF {TWO}")
    assert (made.off(), made.states()["door"]) == (whole(ONE), "active")
    assert made.trees() == [f"{ONE}-1"]
    real()
    made.dpkg("--configure", "-a")
    assert is_complete(made, TWO)


def test_a_disabled_unit_stays_disabled_and_a_first_installation_enables(
    tmp_path: Path, debs: dict[str, Path]
) -> None:
    made = system(tmp_path, debs[ONE])
    assert [line for line in made.called() if "enable " in line] == [
        f"--root={made.root} enable --quiet rmf-bridges.target rmf-bridge-recorder.service"
    ]
    (made.fakes / "disabled/rmf-bridge@failed.service").touch()
    made.dpkg("-i", debs[TWO])
    assert made.states() == {**SERVED, "failed": "failed"}
    assert len([line for line in made.called() if " enable " in line]) == 1


def test_an_installation_after_a_removal_starts_the_earlier_services_and_a_purge_leaves_nothing(
    tmp_path: Path, debs: dict[str, Path]
) -> None:
    made = system(tmp_path, debs[ONE])
    made.dpkg("-r", "rmf-bridges")
    assert set(made.states().values()) == {"inactive", "failed"}
    assert not (made.root / "usr/lib/rmf-bridges").exists()
    made.dpkg("-i", debs[TWO])
    assert made.states() == SERVED
    made.dpkg("-P", "rmf-bridges")
    left = [p for p in made.root.rglob("*") if "rmf" in p.name]
    assert left == []


def test_a_removal_and_a_purge_name_each_service_that_is_not_verified_off(
    tmp_path: Path, debs: dict[str, Path]
) -> None:
    made = system(tmp_path, debs[ONE])
    told = left_on(made)
    for words in ("-r", "-P"):
        done = made.dpkg(words, "rmf-bridges")
        assert (done.returncode, done.stderr.count(told)) == (0, 1)
    assert not (made.root / "var/lib/rmf-bridge").exists()
