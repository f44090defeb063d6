"""A program that runs one check. `python3 -m tests.vm.guest.one deaths.phases` prints the function's
result as JSON.

A check returns its findings, or raises Wrong. The output of the check goes to the log.
"""

import json
import sys
import time
import traceback
from contextlib import redirect_stdout
from importlib import import_module

from tests.vm.guest.system import Wrong, sh


def main() -> int:
    """Run the check. After a failure, log the journal too."""
    module, _, function = sys.argv[1].partition(".")
    check = getattr(import_module(f"tests.vm.guest.{module}"), function)
    began = time.monotonic()
    with redirect_stdout(sys.stderr):
        try:
            found, passed = check(), True
        except Exception as error:  # noqa: BLE001 - a check that breaks has failed
            found, passed = str(error) if isinstance(error, Wrong) else repr(error), False
            traceback.print_exc()
            sh("journalctl", "-b", "-n", "80", "-o", "short-monotonic", "--no-hostname")
    took_s = time.monotonic() - began
    ended = {"passed": passed, "found": found, "took_s": took_s, "says": check.__doc__}
    print(json.dumps(ended))
    return 0


if __name__ == "__main__":
    sys.exit(main())
