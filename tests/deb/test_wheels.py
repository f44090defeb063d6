"""deb/wheels.py fills a package's site-packages from wheels; here from wheels made by the tests."""

import subprocess
import sys
import zipfile
from pathlib import Path

WHEELS = Path(__file__).parents[2] / "deb/wheels.py"


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


def fill(tmp_path: Path, arch: str, *options: str) -> Path:
    """Fill a site-packages for this architecture; return the folder."""
    for each in ("for_arm", "for_pc"):
        wheel(tmp_path, each)
    first = wheel(
        tmp_path,
        "first",
        "for_arm; platform_machine == 'aarch64'",
        "for_pc; platform_machine == 'x86_64'",
    )
    target = tmp_path / "site-packages"
    places = [str(each) for each in (WHEELS, first, "--find-links", tmp_path, "--target", target)]
    subprocess.run(
        [sys.executable, *places, "--arch", arch, "--python", "3.12", *options],
        check=True,
        env={"PIP_NO_INDEX": "1"},
    )
    return target


def test_requirements_are_those_of_the_target_machine(tmp_path: Path) -> None:
    modules = sorted(file.stem for file in fill(tmp_path, "arm64").glob("*.py"))
    assert modules == ["first", "for_arm"]


def test_what_is_not_really_needed_is_left_out(tmp_path: Path) -> None:
    site = fill(tmp_path, "arm64", "--without", "first:for-arm")
    assert [file.stem for file in site.glob("*.py")] == ["first"]


def test_the_daemons_own_user_may_read_what_root_has_built(tmp_path: Path) -> None:
    site = fill(tmp_path, "amd64")
    readable = {path.name: path.stat().st_mode & 0o005 for path in (site, site / "for_pc.py")}
    assert readable == {"site-packages": 0o005, "for_pc.py": 0o004}
