"""A signed apt repository. The test makes it from packages, and the real apt installs from it."""

import os
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "deploy/apt-repository.sh"
CONTROL = """\
Package: {name}
Version: {version}
Architecture: all
Maintainer: rmf-bridges <root@localhost>
Description: a package for a test
"""


@pytest.fixture
def key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Make a signing key in a separate keyring. Return the key's name."""
    home = tmp_path / "gpg"
    home.mkdir(mode=0o700)
    monkeypatch.setenv("GNUPGHOME", str(home))
    words = ("--quick-gen-key", "test@localhost", "ed25519", "sign")
    subprocess.run(["gpg", "--batch", "--passphrase", "", *words], check=True, capture_output=True)
    return "test@localhost"


def package(folder: Path, version: str, name: str = "rmf-bridges-test") -> None:
    root = folder / f"{name}-{version}"
    (root / "DEBIAN").mkdir(parents=True)
    (root / "DEBIAN/control").write_text(CONTROL.format(name=name, version=version))
    (root / "usr/share/rmf-test").mkdir(parents=True)
    (root / "usr/share/rmf-test/version").write_text(version)
    out = folder / f"{name}_{version}_all.deb"
    subprocess.run(["dpkg-deb", "--build", root, out], check=True, capture_output=True)


def made(debs: Path, out: Path, key: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([SCRIPT, debs, out, key], capture_output=True, text=True)


FOLDERS = (
    *("var/lib/dpkg", "var/lib/apt/lists/partial", "var/cache/apt/archives/partial"),
    *("var/log/apt", "etc/apt/apt.conf.d", "etc/apt/preferences.d"),
)


class Machine:
    """A root directory with one source of packages. apt and dpkg have their own folders in it."""

    def __init__(self, root: Path, repository: Path, suite: str) -> None:
        self.root = root
        for folder in FOLDERS:
            (root / folder).mkdir(parents=True)
        (root / "var/lib/dpkg/status").touch()
        key = f"signed-by={repository}/rmf-bridges.gpg"
        source = f"deb [{key}] file:{repository} {suite} main\n"
        (root / "etc/apt/sources.list").write_text(source)
        dpkg = f'DPkg::Options {{ "--root={root}"; "--force-all"; }};'
        (root / "apt.conf").write_text(f'Dir "{root}";\n{dpkg}\n')

    def apt(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run apt-get on this root directory."""
        line = ["apt-get", "-y", "-q", "-o", "APT::Sandbox::User=root", *words]
        config = {"APT_CONFIG": str(self.root / "apt.conf")}
        return subprocess.run(line, env=os.environ | config, capture_output=True, text=True)

    def version(self) -> str:
        """Return the installed package's version."""
        return (self.root / "usr/share/rmf-test/version").read_text()


def test_apt_installs_and_upgrades_from_the_signed_repository(tmp_path: Path, key: str) -> None:
    debs, out = tmp_path / "debs", tmp_path / "repo"
    debs.mkdir()
    package(debs, "1.0.0+deb13")
    package(debs, "1.0.0+deb12")
    assert made(debs, out, key).returncode == 0
    machine = Machine(tmp_path / "machine", out, "deb13")
    assert machine.apt("update").returncode == 0
    done = machine.apt("install", "rmf-bridges-test")
    assert (done.returncode, machine.version()) == (0, "1.0.0+deb13"), done.stderr
    package(debs, "1.1.0+deb13")
    assert made(debs, out, key).returncode == 0
    assert machine.apt("update").returncode == 0
    done = machine.apt("upgrade")
    assert (done.returncode, machine.version()) == (0, "1.1.0+deb13"), done.stderr


def test_apt_refuses_a_repository_that_somebody_has_changed(tmp_path: Path, key: str) -> None:
    debs, out = tmp_path / "debs", tmp_path / "repo"
    debs.mkdir()
    package(debs, "1.0.0+deb13")
    made(debs, out, key)
    signed = out / "dists/deb13/InRelease"
    signed.write_text(signed.read_text().replace("Suite: deb13", "Suite: evil1"))
    (out / "dists/deb13/Release.gpg").unlink()
    done = Machine(tmp_path / "machine", out, "deb13").apt("update")
    assert done.returncode != 0


def test_a_failed_run_leaves_the_old_repository_and_names_the_cause(
    tmp_path: Path, key: str
) -> None:
    debs, out = tmp_path / "debs", tmp_path / "repo"
    debs.mkdir()
    none = made(debs, out, key)
    assert (none.returncode, "make deb" in none.stderr) == (os.EX_NOINPUT, True)
    package(debs, "1.0.0+deb13")
    assert made(debs, out, key).returncode == 0
    unknown = made(debs, out, "nobody@localhost")
    assert (unknown.returncode, "no secret key nobody@localhost" in unknown.stderr) == (67, True)
    assert (out / "dists/deb13/InRelease").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["debs", "gpg", "repo"]
