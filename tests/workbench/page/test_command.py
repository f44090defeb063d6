"""`rmf-bridge page` when it cannot serve: its message and its exit code."""

import os
import subprocess
import sys

WITHOUT_NICEGUI = """
import sys
sys.modules["nicegui"] = None  # as if it were not installed
from bridges.cli import main
sys.exit(main())
"""


def test_without_nicegui_one_line_says_what_to_install() -> None:
    command = [sys.executable, "-c", WITHOUT_NICEGUI, "page", "--listen", "127.0.0.1:0"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ended.returncode == os.EX_UNAVAILABLE
    assert ended.stdout == ""
    (line,) = ended.stderr.splitlines()
    assert line.startswith("rmf-bridge page: ")
    assert line.endswith(": in the git clone of rmf-bridges run .venv/bin/pip install '.[page]'")
