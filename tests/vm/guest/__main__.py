"""A program inside the machine that gets the names of checks from the host. It runs each check in a
separate process, and sends each result to the host."""

import io
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Final

PORT: Final = Path("/dev/virtio-ports/checks")
LONGEST_S: Final = 240.0
BYTE_CODE: Final = ("-X", "pycache_prefix=/run/checks")
"""Python options that store the checks' byte code below /run, because the folder of the checks is read
only. So Python compiles the checks once for each boot. The package's own commands run without these
options."""


def main() -> int:
    """Report that the machine is up. Then read names of checks for ever. Each line has one name, such
    as `deaths.phases`."""
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    # Wait for the end of the boot, because a check could change the measured times of the boot.
    subprocess.run(["systemctl", "is-system-running", "--wait"], stdout=subprocess.DEVNULL)
    while not PORT.exists():
        time.sleep(0.1)
    with PORT.open("r+b", buffering=0) as port:
        _tell(port, {"booted": True})
        for line in iter(port.readline, b""):
            _tell(port, _run(line.decode().strip()))
    return 0


def _tell(port: io.FileIO, what: dict[str, object]) -> None:
    left = json.dumps(what).encode() + b"\n"
    while left:  # a log may be longer than the 32 KB that the kernel takes
        left = left[port.write(left) or 0 :]


def _run(name: str) -> dict[str, object]:
    command = [sys.executable, "-P", *BYTE_CODE, "-m", "tests.vm.guest.one", name]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S)
    except subprocess.TimeoutExpired as late:
        log = (late.stderr or b"").decode()
        return {"passed": False, "found": f"not done within {LONGEST_S:g} s", "log": log}
    if done.returncode:
        return {"passed": False, "found": "it broke: see the log", "log": done.stderr}
    result: dict[str, object] = json.loads(done.stdout)
    return {**result, "log": done.stderr}


if __name__ == "__main__":
    sys.exit(main())
