"""deb/wheels.py fills a package's site-packages from wheels. The tests make these wheels."""

import hashlib
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
WHEELS = ROOT / "deb/wheels.py"
LOCK = ROOT / "deb/lock/runtime.txt"
IN_PACKAGES = ("gpio", "recording", "laptop", "plot", "page")
"""The extras that deb/build.sh puts into packages."""


def wheel(folder: Path, name: str, *needs: str) -> Path:
    """Make a wheel of one module, with these requirements."""
    path = folder / f"{name}-1.0-py3-none-any.whl"
    about = f"{name}-1.0.dist-info"
    requires = "".join(f"Requires-Dist: {need}\n" for need in needs)
    with zipfile.ZipFile(path, "w") as file:
        file.writestr(f"{name}.py", "")
        file.writestr(
            f"{about}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n{requires}"
        )
        file.writestr(
            f"{about}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        file.writestr(f"{about}/RECORD", "")
    return path


def fill(tmp_path: Path, arch: str, *options: str, lock: str | None = None) -> Path:
    """Fill a site-packages for this architecture. By default `lock` lists the wheels that the tests
    made."""
    shop = tmp_path / "shop"
    shop.mkdir()
    wheels = [wheel(shop, each) for each in ("for_arm", "for_pc")]
    first = wheel(
        tmp_path,
        "first",
        "for_arm; platform_machine == 'aarch64'",
        "for_pc; platform_machine == 'x86_64'",
    )
    target = tmp_path / "site-packages"
    locked = tmp_path / "lock.txt"
    locked.write_text("".join(map(pinned, wheels)) if lock is None else lock)
    places = [str(each) for each in (WHEELS, first, "--lock", locked, "--target", target)]
    subprocess.run(
        [sys.executable, *places, "--arch", arch, "--python", "3.12", *options],
        check=True,
        env={"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(shop)},
    )
    return target


def pinned(wheel: Path, marker: str = "") -> str:
    """Return the wheel's entry in a lock file of uv."""
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    name, version, *_ = wheel.name.split("-")
    return f"{name.replace('_', '-')}=={version} {marker}\\\n    --hash=sha256:{digest}\n"


def test_requirements_are_those_of_the_target_machine(tmp_path: Path) -> None:
    modules = sorted(file.stem for file in fill(tmp_path, "arm64").glob("*.py"))
    assert modules == ["first", "for_arm"]


def test_requirements_that_the_target_does_not_need_are_left_out(tmp_path: Path) -> None:
    site = fill(tmp_path, "arm64", "--without", "first:for-arm")
    assert [file.stem for file in site.glob("*.py")] == ["first"]


def test_the_user_of_the_daemons_may_read_files_built_by_root(tmp_path: Path) -> None:
    site = fill(tmp_path, "amd64")
    readable = {path.name: path.stat().st_mode & 0o005 for path in (site, site / "for_pc.py")}
    assert readable == {"site-packages": 0o005, "for_pc.py": 0o004}


def test_a_wheel_whose_hash_is_not_in_the_lock_ends_the_build(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    forged = f"for-pc==1.0 \\\n    --hash=sha256:{'0' * 64}\n"
    with pytest.raises(subprocess.CalledProcessError):
        fill(tmp_path, "amd64", lock=forged)
    assert "DO NOT MATCH THE HASHES" in capfd.readouterr().err
    assert not (tmp_path / "site-packages/for_pc.py").exists()


def test_a_requirement_that_the_lock_lacks_ends_the_build(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(subprocess.CalledProcessError):
        fill(tmp_path, "amd64", lock="# nothing\n")
    assert capfd.readouterr().err.endswith("lock.txt lacks for-pc: make lock\n")


def test_the_version_for_the_target_counts_among_two_versions_in_the_lock(tmp_path: Path) -> None:
    other = f"for-pc==9.0 ; python_version < '3.12' \\\n    --hash=sha256:{'0' * 64}\n"
    right = pinned(wheel(tmp_path, "for_pc"), "; python_version >= '3.12' ")
    site = fill(tmp_path, "amd64", lock=other + right)
    assert (site / "for_pc.py").exists()


def test_without_a_lock_the_wheels_of_the_index_are_taken(tmp_path: Path) -> None:
    first = wheel(tmp_path, "first", "second>=1")
    wheel(tmp_path, "second")
    target = tmp_path / "site-packages"
    words = [
        str(WHEELS),
        str(first),
        "--arch",
        "arm64",
        "--python",
        "3.12",
        "--target",
        str(target),
    ]
    index = {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(tmp_path)}
    subprocess.run([sys.executable, *words], check=True, env=index)
    assert (target / "second.py").exists()


def test_a_wheel_that_was_built_here_is_taken_before_the_lock(tmp_path: Path) -> None:
    here = tmp_path / "built"
    here.mkdir()
    wheel(here, "for_pc")
    site = fill(tmp_path, "amd64", "--built", str(here), lock="# nothing\n")
    assert (site / "for_pc.py").exists()


def test_the_lock_has_a_fitting_version_of_each_library_of_a_package() -> None:
    """If this test fails, run `make lock`."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    wanted = [*project["dependencies"], *(need for one in IN_PACKAGES for need in extras[one])]
    entries = [line.partition("\\")[0] for line in LOCK.read_text().splitlines() if "==" in line]
    locked = {canonicalize_name(Requirement(e).name): Requirement(e) for e in entries}
    for need in map(Requirement, wanted):
        found = locked[canonicalize_name(need.name)]
        (version,) = [one.version for one in found.specifier]
        assert need.specifier.contains(version), f"{need}: {found}"
