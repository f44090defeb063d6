"""Two machines in containers, with Debian 12 and Debian 13. systemd is process 1, and ssh reaches
them."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

PACKAGES: Final = (
    *("dbus", "iproute2", "openssh-server", "openssl", "procps", "python3"),
    *("python3-apt", "systemd", "systemd-sysv", "udev"),
)
PROGRAMS: Final = {
    "apt-ftparchive": "apt-utils",
    "gpg": "gnupg",
    "mmdebstrap": "mmdebstrap",
    "ssh": "openssh-client",
    "systemd-nspawn": "systemd-container",
}
PORTS: Final = {"pi-door1": 2201, "pi-door2": 2202}
SYSTEMS: Final = {"pi-door1": ("bookworm", "deb12"), "pi-door2": ("trixie", "deb13")}
"""For each machine: the release of Debian, and the suffix of this release in the versions of our
packages."""
CGROUPS: Final = Path("/sys/fs/cgroup")


def missing() -> list[str]:
    """Return the packages of the programs that are missing here."""
    return sorted({deb for program, deb in PROGRAMS.items() if not shutil.which(program)})


def debian(trees: Path, release: str) -> None:
    """Make the file tree of the machines with this release of Debian, unless a tree exists."""
    tree = trees / release
    if tree.exists():
        return
    fresh = tree.with_name(f"{release}.new")
    shutil.rmtree(fresh, ignore_errors=True)
    left_out = (f"--dpkgopt=path-exclude=/usr/share/{each}/*" for each in ("doc", "man", "locale"))
    include = f"--include={','.join(PACKAGES)}"
    no_more = '--aptopt=Apt::Install-Recommends "false"'
    words = ["mmdebstrap", "--variant=apt", include, no_more, *left_out, release, str(fresh)]
    subprocess.run(words, check=True)
    fresh.rename(tree)


@contextmanager
def booted(folder: Path, repository: Path) -> Iterator[None]:
    """Boot the machines. At the end of the block their changes are lost."""
    key = folder / "key"
    key.unlink(missing_ok=True)
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key], check=True)
    with ExitStack() as stack:
        for name, port in PORTS.items():
            (folder / f"{name}.conf").write_text(f"Port {port}\nListenAddress 127.0.0.1\n")
            tree = folder / SYSTEMS[name][0]
            (tree / "root/.ssh").mkdir(mode=0o700, exist_ok=True)
            stack.enter_context(_machine(name, folder, tree, repository))
        yield


@contextmanager
def _machine(name: str, folder: Path, tree: Path, repository: Path) -> Iterator[None]:
    root = folder / name
    shutil.rmtree(root, ignore_errors=True)
    subprocess.run(["cp", "-a", "--reflink=auto", tree, root], check=True)
    binds = {
        folder / "key.pub": "/root/.ssh/authorized_keys",
        folder / f"{name}.conf": "/etc/ssh/sshd_config.d/port.conf",
        repository: "/srv/repository",
    }
    words = [
        *("systemd-nspawn", "--boot", f"--directory={root}", f"--machine={name}", "--quiet"),
        *("--register=no", "--keep-unit", "--console=passive", "--kill-signal=SIGRTMIN+4"),
        *(f"--bind-ro={here}:{there}" for here, there in binds.items()),
    ]
    # Each container needs its own control group, because its systemd makes groups below that group.
    into = " ".join(
        f"mkdir -p {each.parent}/rmf-{name}; echo $$ > {each.parent}/rmf-{name}/cgroup.procs;"
        for each in (*CGROUPS.glob("cgroup.procs"), *CGROUPS.glob("*/cgroup.procs"))
    )
    with (folder / f"{name}.log").open("w") as log:
        nspawn = subprocess.Popen(
            ["sh", "-c", f'{into} exec "$@"', "sh", *words],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
        )
        try:
            yield
        finally:
            nspawn.terminate()  # so nspawn shuts the container down in good order
            nspawn.wait()
            shutil.rmtree(root, ignore_errors=True)
