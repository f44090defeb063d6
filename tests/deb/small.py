"""Small packages with our own maintainer scripts, and a root into which the real dpkg installs them.

The scripts call real commands except `systemctl`. The stand-in for `systemctl` keeps a file for each
unit. A counter counts each command that changes something. At a chosen count the test kills all
processes, even dpkg, as a power cut would.
"""

import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Collection
from functools import partial
from pathlib import Path

SCRIPTS = Path(__file__).parents[2] / "deb/scripts"
LIB = Path("usr/lib/rmf-bridges")
COUNTED = ("cp", "ln", "mv", "nice", "rm", "sync", "systemctl")
SITE = Path("lib/python3/site-packages")
FORCE = ("script-chrootless", "not-root", "bad-path", "confold")
PROGRAM = """#!/usr/bin/python3
# A program that tells its version, and in which tree it is.
import pathlib, sys
version = {version!r}
command, *words = sys.argv[1:]
tree = pathlib.Path(__file__).resolve().parent.parent
if command == "check":
    wrong = [w for w in words if w != "--quiet" and version in pathlib.Path(w).read_text()]
    print(*(f"{{file}}:1:1: refused" for file in wrong))
    sys.exit(78 if wrong else 0)
if command == "enable":
    print(f"drop-in of {{version}}")
if command == "outputs-off":
    print(version, *sorted(p.name for p in (tree / "lib").glob("module_*")))
"""
FAKE = """#!/bin/sh
n=$(($(cat {here}/count 2>/dev/null || echo 0) + 1)); echo $n > {here}/count
[ $n != "$(cat {here}/cut 2>/dev/null)" ] || kill -9 0
{does}
"""
SYSTEMCTL = """
echo "$*" >> {here}/calls
cd {here}/units; words= states=
for w; do case $w in --state=*) states=${{w#*=}} ;; -*) ;; *) words="$words $w" ;; esac; done
set -- $words
command=$1; shift
case $command in
  list-units) for u; do read -r s < "$u" || continue
    case ,$states, in *,$s,*) echo "$u loaded $s sub of it" ;; esac; done ;;
  stop) for u; do [ "$(cat "$u")" = failed ] || echo inactive > "$u"; done ;;
  start) for u; do if [ -e "../absent/$u" ]; then echo failed; else echo active; fi > "$u"; done ;;
  is-enabled) [ ! -e "../disabled/$1" ] ;;
  is-active) [ "$(cat "$1")" = active ] ;;
esac
"""


def package(folder: Path, version: str, modules: Collection[str], *, old: bool = False) -> Path:
    """Return one of our packages. `old` makes it a package from before 0.1.0+r, when dpkg owned the
    tree."""
    work = folder / version
    tree = work / LIB if old else work.with_suffix(".tree")
    (tree / "bin").mkdir(parents=True)
    (tree / SITE).mkdir(parents=True)
    for name in modules:
        (tree / "lib" / name).write_text(version)
    (tree / "pyvenv.cfg").touch()
    (tree / "bin/python3").symlink_to("/usr/bin/python3")
    program = tree / "bin/rmf-bridge"
    program.write_text(PROGRAM.format(version=version))
    program.chmod(0o755)
    if not old:
        archived(work, tree)
    return built(work, "rmf-bridges", version, scripts=not old)


def archived(work: Path, tree: Path) -> None:
    """Put this tree into a package as deb/build.sh does."""
    (work / LIB / "bin").mkdir(parents=True)
    (work / LIB / "bin/rmf-bridge").symlink_to("../current/bin/rmf-bridge")
    shutil.make_archive(str(work / LIB / "tree"), "xztar", tree)


def built(work: Path, name: str, version: str, *more: str, scripts: bool = True) -> Path:
    """Return the package built from this folder, with `more` fields and our maintainer `scripts`."""
    fields = (f"Package: {name}", f"Version: {version}", "Architecture: all", *more)
    control = "\n".join((*fields, "Maintainer: n <n@n>", "Description: small", ""))
    (work / "DEBIAN").mkdir(parents=True)
    (work / "DEBIAN/control").write_text(control)
    for script in SCRIPTS.glob(f"{name}.*") if scripts else ():
        target = work / "DEBIAN" / script.suffix[1:]
        text = script.read_text().replace("@PYTHON@", "3").replace("@VERSION@", version)
        target.write_text(text)
        target.chmod(0o755)
    made = work.with_name(f"{work.name}.deb")
    words = ["dpkg-deb", "--root-owner-group", "-Znone", "--build", str(work), str(made)]
    subprocess.run(words, check=True, capture_output=True)
    return made


def _replace(file: Path, text: str) -> None:
    file.write_text(text)


class System:
    """A root directory with services. Its `systemctl` starts nothing, and only keeps each service's
    state in a file."""

    def __init__(self, folder: Path) -> None:
        self.root, self.fakes = folder / "root", folder / "fakes"
        for name in (
            "var/lib/dpkg/info",
            "var/lib/dpkg/updates",
            "run/systemd/system",
            "etc/rmf-bridges",
        ):
            (self.root / name).mkdir(parents=True)
        (self.root / "var/lib/dpkg/status").touch()
        for name in ("bin", "units", "absent", "disabled"):
            (self.fakes / name).mkdir(parents=True)
        real = {name: f'exec {shutil.which(name)} "$@"' for name in COUNTED}
        real["systemctl"] = SYSTEMCTL.format(here=self.fakes)
        for name, does in real.items():
            self._fake(name, FAKE.format(here=self.fakes, does=does))
        for name in ("udevadm", "systemd-sysusers", "systemd-tmpfiles", "ldconfig"):
            self._fake(name, "#!/bin/sh\n")

    def _fake(self, name: str, text: str) -> None:
        (self.fakes / "bin" / name).write_text(text)
        (self.fakes / "bin" / name).chmod(0o755)

    def service(self, name: str, state: str = "active") -> None:
        """Make a service as the command `enable` does."""
        (self.root / f"etc/rmf-bridges/{name}.yaml").write_text("kind: lift\n")
        self.drop_in(name).parent.mkdir(parents=True)
        self.drop_in(name).write_text("drop-in of nothing\n")
        self.unit(name).write_text(f"{state}\n")

    def drop_in(self, name: str) -> Path:
        return self.root / f"etc/systemd/system/rmf-bridge@{name}.service.d/10-enable.conf"

    def unit(self, name: str) -> Path:
        """Return the file with the state of this service."""
        return self.fakes / f"units/rmf-bridge@{name}.service"

    def states(self) -> dict[str, str]:
        """Return the state of each service."""
        return {
            path.name.partition("@")[2].removesuffix(".service"): path.read_text().strip()
            for path in sorted((self.fakes / "units").glob("rmf-bridge@*"))
        }

    def dpkg(self, *words: str | Path, cut: int = 0) -> subprocess.CompletedProcess[str]:
        """Run dpkg. If `cut` is not 0, kill all processes at the counted command with that number."""
        (self.fakes / "count").unlink(missing_ok=True)
        (self.fakes / "cut").write_text(str(cut))
        force = [f"--force-{each}" for each in FORCE]
        path = f"{self.fakes}/bin:/usr/sbin:/usr/bin:/sbin:/bin"
        command = ["dpkg", f"--root={self.root}", "--log=/dev/null", *force, *map(str, words)]
        env = {"PATH": path, "HOME": "/", "LC_ALL": "C"}
        done = subprocess.run(
            command, env=env, capture_output=True, text=True, start_new_session=True
        )
        assert done.returncode in (0, 1, 2) or (cut and done.returncode == -signal.SIGKILL), done
        return done

    def fails(self, name: str) -> Callable[[], None]:
        """Let a command fail, as on a full disk. Return a function that repairs the command."""
        file = self.fakes / "bin" / name
        real = file.read_text()
        file.write_text("#!/bin/sh\nexit 1\n")
        return partial(_replace, file, real)

    def called(self) -> list[str]:
        """Return the calls of systemctl so far."""
        return (self.fakes / "calls").read_text().splitlines()

    def counted(self) -> int:
        """Return the number of commands that the last run of dpkg has counted."""
        return int((self.fakes / "count").read_text())

    def off(self) -> str:
        """Return what `outputs-off` prints: its version, and the modules of its tree."""
        done = subprocess.run(
            [self.root / LIB / "bin/rmf-bridge", "outputs-off"], capture_output=True
        )
        return (done.stdout + done.stderr).decode().strip()

    def status(self) -> str:
        """Return the package's state and version, as dpkg reports them."""
        words = ["dpkg-query", f"--admindir={self.root}/var/lib/dpkg", "-W"]
        text = "${db:Status-Abbrev}${Version}"
        return subprocess.run([*words, "-f", text], capture_output=True, text=True).stdout

    def trees(self) -> list[str]:
        return sorted(os.listdir(self.root / LIB / "trees"))
