import subprocess
import sys
from pathlib import Path

from drivers.hal.gpio.holders import holders


def test_a_process_that_has_the_chip_open_is_named_by_its_command(tmp_path: Path) -> None:
    chip = tmp_path / "gpiochip0"
    chip.write_text("")
    hold = f"import sys; c = open({str(chip)!r}); print('open', flush=True); sys.stdin.read()"
    command = [sys.executable, "-c", hold]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout
        other.stdout.readline()
        (named,) = holders(chip)
        assert other.stdin
        other.stdin.close()
    assert named.startswith(f"process {other.pid} ({sys.executable} -c")
    assert holders(chip) == []


def test_a_service_is_named_by_its_unit(tmp_path: Path) -> None:
    for pid, group in (
        ("1000017", "/system.slice/system-rmf\\x2dbridge.slice/rmf-bridge@lift.service"),
        ("1000018", "/user.slice/user-1000.slice/session-3.scope"),
    ):
        process = tmp_path / pid
        (process / "fd").mkdir(parents=True)
        (process / "fd" / "7").symlink_to("/dev/gpiochip0")
        (process / "cgroup").write_text(f"0::{group}\n")
        (process / "cmdline").write_bytes(b"gpiomon\0-c\0gpiochip0\0")
    (tmp_path / "self").mkdir()
    assert holders(Path("/dev/gpiochip0"), tmp_path) == [
        "process 1000018 (gpiomon -c gpiochip0)",
        "rmf-bridge@lift.service",
    ]
    assert holders(Path("/dev/gpiochip1"), tmp_path) == []
