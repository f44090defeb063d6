"""`make test-rollout` installs versions of our packages on two booted machines, and prints a line for
each check.

The command must run as root. The exit code is 1 if a check failed, and 69 if no check ran.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Final

from tests.deb.next_version import next_version
from tests.rollout.machines import PORTS, SYSTEMS, booted, debian, missing
from tests.rollout.versions import broken, cut_off

ROOT: Final = Path(__file__).parents[2]
WORK: Final = ROOT / "build/rollout"
BIN: Final = ROOT / ".venv/bin"
INSIDE: Final = "RMF_ROLLOUT_INSIDE"
"""The environment variable that marks the inner process. This process has a network with only
loopback."""
ENV: Final = os.environ | {
    "PATH": f"{BIN}:{os.environ['PATH']}",
    "GNUPGHOME": str(WORK / "gpg"),
    "URI": "file:/srv/repository",
    "ANSIBLE_COLLECTIONS_PATH": str(WORK / "collections"),
    "ANSIBLE_LOCALHOST_WARNING": "false",
    "ANSIBLE_HOST_KEY_CHECKING": "false",
    "ANSIBLE_DEPRECATION_WARNINGS": "false",
    "ANSIBLE_NOCOLOR": "true",
}
FIRST, SECOND = PORTS


def main() -> int:
    """Download and build the machines. Then run the checks in another process, whose network has only
    loopback."""
    if os.geteuid() != 0:
        print("containers need root: sudo make test-rollout", file=sys.stderr)
        return os.EX_UNAVAILABLE
    if packages := missing():
        print(f"missing here: sudo apt install {' '.join(packages)}", file=sys.stderr)
        return os.EX_UNAVAILABLE
    WORK.mkdir(parents=True, exist_ok=True)
    if INSIDE not in os.environ:
        for release, _ in SYSTEMS.values():
            debian(WORK, release)
        words = ["unshare", "--net", "--mount", sys.executable, "-m", "tests.rollout"]
        return subprocess.run(words, env=os.environ | {INSIDE: "1"}).returncode
    # exit by an exception, so that the containers are shut down too
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    sh("ip", "link", "set", "lo", "up")
    try:
        return Rollouts().run()
    finally:
        sh("gpgconf", "--kill", "all")


def sh(*words: object, check: bool = True) -> subprocess.CompletedProcess[str]:
    """Run a command, and return its result with the output."""
    done = subprocess.run([str(word) for word in words], env=ENV, capture_output=True, text=True)
    if check and done.returncode:
        raise RuntimeError(f"{words}: {done.stdout}{done.stderr}")
    return done


VERSIONS: Final = {".1": None, ".2": broken, ".3": cut_off}
"""The suffixes of the versions after the built version, with the function that breaks each version.

The first version works, and the two others fail.
"""


def repository() -> str:
    """Make the package repository. Return the version of the built packages without the suffix for the
    system."""
    packages = [
        deb
        for _, name in SYSTEMS.values()
        for deb in sorted((ROOT / "dist").glob(f"*+{name}_amd64.deb"))
    ]
    built = {deb.name.split("_")[1].rpartition("+")[0] for deb in packages}
    (old,) = built or {"none"}
    debs, made = WORK / "debs", WORK / "debs/made"
    if not made.exists() or made.read_text() != old:
        sh("rm", "-rf", debs)
        debs.mkdir()
        for each in packages:
            sh("cp", each, debs)
            for more, change in VERSIONS.items():
                new = each.name.split("_")[1].replace(f"{old}+", f"{old}{more}+")
                next_version(each, debs, new, change)
        made.write_text(old)
    sh("rm", "-rf", WORK / "gpg", WORK / "apt")
    (WORK / "gpg").mkdir(mode=0o700)
    sh("gpg", "--batch", "--passphrase", "", "--quick-gen-key", "test@localhost", "ed25519", "sign")
    sh(ROOT / "deploy/apt-repository.sh", debs, WORK / "apt", "test@localhost")
    return old


def door(name: str, api_base: str) -> str:
    """Return the YAML of a door behind an HTTP relay."""
    text = (ROOT / "config/door_http.yaml").read_text().replace("side_door", name)
    text = text.replace("transport: auto", "transport: dds\n  network: localhost")
    return text.replace("192.168.1.70", api_base)


@contextmanager
def relays() -> Iterator[dict[str, str]]:
    """Write the inventory's folder, with the YAML file of a door for each machine. Run a simulated
    relay for each door.

    Yield the API address of each machine's relay.
    """
    sh("rm", "-rf", WORK / "site")
    bases = {}
    with ExitStack() as stack:
        for number, machine in enumerate(PORTS, 1):
            folder = WORK / "site/machines" / machine
            folder.mkdir(parents=True)
            file = folder / f"door{number}.yaml"
            file.write_text(door(f"door{number}", "http://127.0.0.1:1"))
            words = ["-m", "hal_fakes", str(file), "relay", "--socket", str(WORK / machine[3:])]
            fake = subprocess.Popen([sys.executable, *words], stdin=-1, stdout=-1, text=True)
            stack.callback(fake.wait)
            assert fake.stdin
            assert fake.stdout
            stack.callback(fake.stdin.close)
            bases[machine] = json.loads(fake.stdout.readline())["api_base"]
            file.write_text(door(f"door{number}", bases[machine]))
        supervisor = (ROOT / "config/door_supervisor.yaml").read_text()
        supervisor = supervisor.replace("transport: auto", "transport: dds\n  network: localhost")
        (WORK / f"site/machines/{SECOND}/door_supervisor.yaml").write_text(supervisor)
        hosts = "".join(
            f"    {name}: {{ansible_host: 127.0.0.1, ansible_port: {port}, ansible_user: root,\n"
            f"      ansible_ssh_private_key_file: {WORK}/key}}\n"
            for name, port in PORTS.items()
        )
        (WORK / "site/inventory.yml").write_text(
            f"rmf_bridges:\n  hosts:\n{hosts}  vars:\n"
            f"    rmf_bridges_repository: {WORK}/apt\n    rmf_bridges_watched_s: 10\n"
            "    rmf_bridges_serves_tries: 5\n    rmf_bridges_idle_tries: 2\n"
            "    rmf_bridges_idle_pause_s: 1\n"
            f"recorders: {{hosts: {{{FIRST}: }}}}\nexporters: {{hosts: {{{SECOND}: }}}}\n"
            f"pages: {{hosts: {{{FIRST}: }}}}\n"
        )
        yield bases


def renew(yaml: Path) -> None:
    """Write the checksum of the present YAML file into its form.

    The form is the record of a kill test. A new kill test would write the checksum, too.
    """
    form, new = yaml.with_suffix(".md"), sha256(yaml.read_bytes()).hexdigest()
    form.write_text(re.sub("sha256 [0-9a-f]{64}", f"sha256 {new}", form.read_text()))


class Rollouts:
    """All rollouts with their checks, in the order in which they run."""

    def __init__(self) -> None:
        self.failed = 0
        self.old = repository()
        self.good, self.bad, self.lost = (f"{self.old}{more}" for more in VERSIONS)

    def run(self) -> int:
        """Run all rollouts. Return 1 if a check failed, else 0."""
        sh(BIN / "ansible-galaxy", "collection", "install", "--force", "-p", WORK / "collections",
           ROOT / "deploy/ansible")  # fmt: skip
        with relays() as bases, booted(WORK, WORK / "apt"):
            self._reachable()
            for step in (self._kill_tests, self._names, self._install, self._in_use, self._broken):
                step(bases)
            self._cut_off()
            self._new_file_refused(bases)
            self._upgrade(bases)
        print(f"{self.failed} failed; the logs are in {WORK}")
        return 1 if self.failed else 0

    def _kill_tests(self, bases: dict[str, str]) -> None:
        done = self._roll("no-kill-test", self.old)
        self._expect("without forms nothing is installed", done != 0, self._versions() == ["", ""])
        self._expect("the missing form is named", "door1.yaml: there is no form" in self.said)
        for number, machine in enumerate(PORTS, 1):
            yaml = WORK / f"site/machines/{machine}/door{number}.yaml"
            form = yaml.with_suffix(".md")
            sh(BIN / "rmf-bridge", "doctor", yaml, "--kill-test", "--yes", "--form", form,
               "--runtime-dir", WORK / "run", check=False)  # fmt: skip

    def _names(self, bases: dict[str, str]) -> None:
        yaml = WORK / f"site/machines/{SECOND}/door2.yaml"
        kept = yaml.read_text()
        yaml.write_text(kept.replace("door2:", "door1:"))
        done = self._roll("same-name", self.old)
        self._expect(
            "one name on two machines stops the rollout",
            done != 0,
            "'door1' is used in" in self.said,
        )
        yaml.write_text(kept)

    def _install(self, bases: dict[str, str]) -> None:
        done = self._roll("preview", self.old, "--check")
        self._expect("a preview changes nothing", done == 0, self._versions() == ["", ""])
        done = self._roll("install", self.old)
        self._expect("the first installation", done == 0, self._versions() == [self.old] * 2)
        self._expect("every daemon serves", *self._serving())
        metrics = sh("curl", "-s", "127.0.0.1:9763/metrics").stdout
        for name in ("door2", "door_supervisor"):
            up = f'rmf_bridge_daemon_up{{daemon="{name}"}} 1.0' in metrics
            self._expect(f"the exporter reads the status of {name}", up)
        self._users()

    def _users(self) -> None:
        """Check that each service has its own user, even after a power cut."""
        state = "/var/lib/rmf-bridge"
        owners = [
            self._on(SECOND, f"stat -c %U {state}/{name}") for name in ("door2", "door_supervisor")
        ]
        self._expect("each service has a user of its own", owners[0] != owners[1])
        write = f"su -s /bin/sh {owners[1].strip()} -c 'echo > {state}/door2/kept.json'; echo $?"
        self._expect("no service writes another's state", self._on(SECOND, write).strip() != "0")
        self._on(
            FIRST,
            f"cd {state}/door1; cp -p claimed-*.json /run; systemctl stop rmf-bridge@door1;"
            " mv /run/claimed-*.json .; rm -rf /run/rmf-bridge/door1;"
            " systemctl restart rmf-bridge-outputs-off",
        )
        left = self._on(FIRST, f"ls {state}/door1")
        made = self._on(FIRST, f"stat -c %U /run/rmf-bridge/door1 {state}/door1").split()
        self._expect(
            "at boot the outputs of a lost daemon are switched off, by the daemon's own user",
            "claimed-" not in left,
            len(set(made)) == 1,
            made != ["root"] * 2,
        )
        self._on(FIRST, "systemctl start rmf-bridge@door1")
        self._expect("the daemon serves again", *self._serving())

    def _in_use(self, bases: dict[str, str]) -> None:
        self._send("open")
        done = self._roll("in-use", self.good)
        self._expect("a held door stops the rollout", done != 0, "door1 is in use" in self.said)
        self._expect("no machine was changed", self._versions() == [self.old] * 2)
        self._send("close")
        self._on(FIRST, "systemctl stop rmf-bridge@door1")
        done = self._roll("stopped", self.good)
        self._expect(
            "a stopped service stops the rollout", done != 0, "machine: door1" in self.said
        )
        self._on(FIRST, "systemctl start rmf-bridge@door1")

    def _broken(self, bases: dict[str, str]) -> None:
        yaml = WORK / f"site/machines/{FIRST}/door1.yaml"
        kept = yaml.read_text()
        yaml.write_text(kept.replace("scan_s: 1", "scan_s: 0.9"))
        done = self._roll("old-form", self.bad)
        old = "door1.yaml: the form was made for an earlier version" in self.said
        self._expect("a form older than its YAML stops the rollout", done != 0, old)
        renew(yaml)
        done = self._roll("broken", self.bad)
        self._expect(
            "a version that cannot start stops the rollout",
            done != 0,
            "did not come back" in self.said,
        )
        self._expect("the old version is back", self._versions() == [self.old] * 2)
        self._expect(
            "the old file is back", self._on(FIRST, "cat /etc/rmf-bridges/door1.yaml") == kept
        )
        self._expect("the second machine was never asked", f"[{SECOND}]" not in self._changed())
        self._expect("every daemon serves again", *self._serving())
        yaml.write_text(kept)
        renew(yaml)

    def _cut_off(self) -> None:
        """Cut the first machine off while it gets a new version, first for a short time, and then for
        too long."""
        self._on(FIRST, "echo 90 > /run/cut-off-for")
        done = self._roll("cut-off", self.lost, "-e", "rmf_bridges_reached_again_s=300")
        lost = "did not come back" in self.said and "could not be reached any more" in self.said
        self._expect("a machine that cannot be reached stops the rollout", done != 0, lost)
        self._expect(
            "the machine is put back when it answers again", self._versions() == [self.old] * 2
        )
        self._expect("every daemon serves again", *self._serving())
        done = self._roll("unknown", self.lost, "-e", "rmf_bridges_reached_again_s=5")
        self._expect(
            "a machine that stays away has an unknown state",
            done != 0,
            f"state unknown: {FIRST}" in self.said,
        )
        self._expect("the second machine was never asked", f"[{SECOND}]" not in self._changed())
        self._reachable()
        done = self._play("put-back", "put_back", "--limit", FIRST)
        self._expect(
            "the command that the message names puts the machine back",
            done == 0,
            self._versions() == [self.old] * 2,
        )
        self._expect("every daemon serves again", *self._serving())

    def _new_file_refused(self, bases: dict[str, str]) -> None:
        """Roll out a good version, and a file that no daemon can serve. The old version and the old
        files must come back."""
        folder = WORK / f"site/machines/{FIRST}"
        new = door("door3", "http://127.0.0.1:1")
        (folder / "door3.yaml").write_text(new)
        form = (folder / "door1.md").read_text().replace("door1.yaml", "door3.yaml")
        (folder / "door3.md").write_text(form)
        renew(folder / "door3.yaml")
        done = self._roll("dead-device", self.good)
        self._expect(
            "a dead device stops the rollout", done != 0, "door3: a fault that" in self.said
        )
        self._expect("its outputs are named", "door3: NOT VERIFIED OFF" in self.said)
        self._on(FIRST, "rm -r /var/lib/rmf-bridge/door3 /run/rmf-bridge/door3")  # cut off
        self._on(FIRST, "rm /etc/rmf-bridges/door3.yaml; systemctl reset-failed")
        self._expect("the old version is back", self._versions() == [self.old] * 2)
        left = self._on(FIRST, "ls /etc/systemd/system/rmf-bridges.target.wants")
        self._expect("the new service is gone", "door3" not in left, "door1" in left)
        self._expect("every daemon serves again", *self._serving())
        for each in folder.glob("door3.*"):
            each.unlink()

    def _upgrade(self, bases: dict[str, str]) -> None:
        yaml = WORK / f"site/machines/{FIRST}/door1.yaml"
        yaml.write_text(yaml.read_text().replace("scan_s: 1", "scan_s: 0.9"))
        renew(yaml)
        taken = f"rmf_bridges_exporter_options='--no-graph --listen 127.0.0.1:{PORTS[FIRST]}'"
        done = self._roll("exporter", self.good, "-e", taken)
        died = "rmf-bridge-exporter.service: activating" in self.said
        self._expect("an exporter that does not stay up stops the rollout", done != 0, died)
        versions = [self.good, self.old]
        self._expect(
            "its machine is put back, and the first machine keeps the new version",
            self._versions() == versions,
        )
        self._expect("the old exporter runs again", self._runs(SECOND, "exporter"))
        done = self._roll("upgrade", self.good)
        self._expect("an upgrade", done == 0, self._versions() == [self.good] * 2)
        there = self._on(FIRST, "cat /etc/rmf-bridges/door1.yaml")
        self._expect("the new file is there", "scan_s: 0.9" in there)
        self._expect("every daemon serves", *self._serving())
        self._expect("page and recorder run", self._runs(FIRST, "page", "recorder"))
        self._expect("the page answers", "<title>" in sh("curl", "-s", "127.0.0.1:8080").stdout)
        pids = self._pids()
        done = self._roll("again", self.good)
        self._expect("a second time restarts nothing", done == 0, self._pids() == pids)

    def _roll(self, name: str, version: str, *more: str) -> int:
        return self._play(name, "rollout", "-e", f"rmf_bridges_version={version}", *more)

    def _play(self, name: str, playbook: str, *more: str) -> int:
        began = time.monotonic()
        done = sh(BIN / "ansible-playbook", "-i", WORK / "site/inventory.yml",
                  f"rmf_bridges.site.{playbook}", *more, check=False)  # fmt: skip
        self.said = done.stdout + done.stderr
        (WORK / f"{name}.log").write_text(self.said)
        print(
            f"      {time.monotonic() - began:6.1f} s  {name}: exit code {done.returncode}",
            flush=True,
        )
        return done.returncode

    def _runs(self, machine: str, *units: str) -> bool:
        ask = " ".join(f"rmf-bridge-{unit}" for unit in units)
        return self._on(machine, f"systemctl is-active {ask}") == "active\n" * len(units)

    def _changed(self) -> str:
        return self.said.partition("Change one machine after the other")[2]

    def _expect(self, says: str, *true: bool) -> None:
        self.failed += not all(true)
        print(f"{'ok' if all(true) else 'FAIL':4}  {says}", flush=True)

    def _on(self, machine: str, command: str) -> str:
        words = ["-q", "-i", WORK / "key", "-p", PORTS[machine], "-o", "StrictHostKeyChecking=no"]
        return sh("ssh", *words, "root@127.0.0.1", command, check=False).stdout

    def _reachable(self) -> None:
        for machine in PORTS:
            deadline = time.monotonic() + 180
            while self._on(machine, "systemctl is-system-running --wait") != "running\n":
                if time.monotonic() > deadline:
                    raise RuntimeError(f"{machine} does not boot: {WORK / machine}.log")
                time.sleep(0.5)

    def _versions(self) -> list[str]:
        ask = "dpkg-query -W -f '${db:Status-Abbrev}${Version}' rmf-bridges"
        told = [self._on(machine, ask).removeprefix("ii ") for machine in PORTS]
        systems = (name for _, name in SYSTEMS.values())
        return [one.removesuffix(f"+{name}") for one, name in zip(told, systems, strict=True)]

    def _pids(self) -> list[str]:
        return [self._on(each, "systemctl show -p MainPID 'rmf-bridge@*'") for each in PORTS]

    def _serving(self) -> list[bool]:
        told = [json.loads(self._on(each, "rmf-bridge status --json") or "[]") for each in PORTS]
        daemons = [one for each in told for one in each]
        well = all(one["state"] == "serving" and not one["level"] for one in daemons)
        return [[len(each) for each in told] == [1, 2], well]

    def _send(self, what: str) -> None:
        sh(BIN / "rmf-bridge", "send", "door", "door1", what, "--localhost",
           "--transport", "dds")  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
