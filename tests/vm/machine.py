"""QEMU with our image: boot, run a check, cut the power. QEMU uses KVM if KVM boots here, else TCG.

Under TCG the machine's clock counts instructions, one for each nanosecond (`-icount shift=0`). So even
on a busy host the measured times are those of a core of 1,000 MIPS.
"""

import json
import os
import socket
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tests.vm.image import Image, Unusable, needed

PROBE_S: Final = 10.0
BOOT_S: Final = 1800.0
ANSWER_S: Final = 3600.0
"""Limits (s) by the host's clock. The limits are much longer than normal, because the host may be
busy."""


@dataclass(frozen=True, slots=True)
class Arch:
    """QEMU's options for an architecture. `tcg` has the options for a clock that counts
    instructions."""

    program: str
    package: str
    machine: tuple[str, ...]
    tcg: tuple[str, ...]
    console: str


FAST: Final = "mitigations=off"
"""A kernel option for speed. The option switches off the kernel's protection against flaws of real
processors, such as Spectre.

Two features of the processor also cost time under TCG: page tables with five levels, and SMAP. SMAP
keeps the kernel from reading a program's memory. So QEMU's amd64 processor has neither feature.
"""
COUNTED: Final = ("-accel", "tcg", "-icount", "shift=0")
ARCHS: Final = {
    "amd64": Arch(
        "qemu-system-x86_64",
        "qemu-system-x86",
        ("-M", "q35"),
        (*COUNTED, "-cpu", "max,la57=off,smap=off,smep=off,umip=off"),
        "ttyS0",
    ),
    "arm64": Arch(
        "qemu-system-aarch64",
        "qemu-system-arm",
        ("-M", "virt"),
        (*COUNTED, "-cpu", "cortex-a72"),
        "ttyAMA0",
    ),
}
ENDS_WITH_US: Final = ("setpriv", "--pdeathsig", "KILL")
"""The first words of a command. Because of these words, the kernel kills the command's process when the
thread that started the process ends."""
KVM: Final = ("-accel", "kvm", "-cpu", "host")


def accelerated(arch: str, image: Image) -> bool:
    """Return whether KVM boots this kernel here. Even if /dev/kvm opens, KVM may hang."""
    if not os.access("/dev/kvm", os.R_OK | os.W_OK):
        return False
    found = ARCHS[arch]
    console = f"console={found.console} earlyprintk=serial panic=-1 rdinit=/bin/busybox"
    words = [found.program, *found.machine, *KVM, "-m", "512", "-nodefaults", "-no-user-config"]
    words += ["-display", "none", "-no-reboot", "-serial", "stdio", *_kernel(image, console)]
    try:
        done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, timeout=PROBE_S)
    except subprocess.TimeoutExpired:
        return False
    return b"Run /bin/busybox" in done.stdout


def _kernel(image: Image, words: str) -> list[str]:
    return ["-kernel", str(image.kernel), "-initrd", str(image.ram_disk), "-append", words]


class Machine:
    """A running machine. Its disk keeps its content after `cut_power`, but not after `close`.

    `shared` maps 9p tags to folders of the host, which the machine can mount. `folder` holds the
    console's log and QEMU's sockets.
    """

    def __init__(
        self, arch: str, image: Image, kvm: bool, shared: dict[str, Path], folder: Path
    ) -> None:
        found = ARCHS[arch]
        needed({found.program: found.package})
        folder.mkdir(exist_ok=True)
        self._sockets = {name: folder / f"{name}.sock" for name in ("checks", "qmp")}
        for path in self._sockets.values():
            path.unlink(missing_ok=True)
        words = f"console={found.console} systemd.mask=serial-getty@{found.console}.service {FAST}"
        command = [found.program, *found.machine, *(KVM if kvm else found.tcg), "-m", "1024"]
        command += ["-nodefaults", "-no-user-config", "-display", "none", "-nic", "none"]
        command += ["-rtc", "base=utc,clock=vm", "-serial", f"file:{folder / 'console.log'}"]
        command += ["-drive", f"file={image.root},format=raw,if=virtio,snapshot=on"]
        command += ["-qmp", f"unix:{self._sockets['qmp']},server=on,wait=off"]
        command += [
            "-chardev",
            f"socket,id=checks,path={self._sockets['checks']},server=on,wait=off",
        ]
        command += [
            "-device",
            "virtio-serial",
            "-device",
            "virtserialport,chardev=checks,name=checks",
        ]
        for tag, path in shared.items():
            command += [
                "-virtfs",
                f"local,path={path},mount_tag={tag},security_model=none,readonly=on",
            ]
        self._process = subprocess.Popen([*ENDS_WITH_US, *command, *_kernel(image, words)])
        self._port = self._connect("checks")
        self._lines = self._port.makefile("rb")
        self.booted()

    def booted(self) -> None:
        """Wait until the machine reports that it has booted. Raises Unusable."""
        self._port.settimeout(BOOT_S)
        while "booted" not in (heard := self._heard()):
            if not heard["passed"]:  # a check that restarts the machine has failed
                raise Unusable(f"{heard['found']}\n{heard['log']}")

    def check(self, name: str) -> dict[str, Any]:
        """Run one check, and return its result."""
        self._port.settimeout(ANSWER_S)
        self._port.sendall(name.encode() + b"\n")
        return self._heard()

    def restarts(self, check: str) -> None:
        """Run a check that ends with a restart of the machine. Raises Unusable if the check fails."""
        self._port.sendall(check.encode() + b"\n")
        self.booted()

    def cut_power(self) -> None:
        """Reset the machine. Data that is not yet on the disk gets lost."""
        with self._connect("qmp") as qmp, qmp.makefile("rb") as answers:
            for command in ("qmp_capabilities", "system_reset"):
                qmp.sendall(json.dumps({"execute": command}).encode())
                while "return" not in json.loads(answers.readline()):
                    continue
        self.booted()

    def close(self) -> None:
        """End the machine. May be called twice."""
        self._process.kill()
        self._process.wait()
        self._port.close()

    def _heard(self) -> dict[str, Any]:
        try:
            line = self._lines.readline()
        except TimeoutError:
            line = b""
        if not line:
            raise Unusable(
                "the machine does not answer; read the end of console.log for the reason"
            )
        heard: dict[str, Any] = json.loads(line)
        return heard

    def _connect(self, name: str) -> socket.socket:
        deadline = time.monotonic() + PROBE_S
        connected = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        while True:
            try:
                connected.connect(str(self._sockets[name]))
            except OSError as error:
                if self._process.poll() is not None or time.monotonic() > deadline:
                    raise Unusable(f"QEMU did not start: {error}") from error
                time.sleep(0.1)
            else:
                return connected
