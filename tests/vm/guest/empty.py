"""A Python service that does nothing. `figures.py` measures its start, memory and end, and compares our
services with it.

Without arguments this program is the service. With the argument `off` it is the service's ExecStopPost.
"""

import os
import signal
import socket
import sys
import time
from pathlib import Path

if sys.argv[1:]:
    Path("/run/empty").write_text(str(time.monotonic()))
else:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as told:
        told.sendto(b"READY=1", os.environ["NOTIFY_SOCKET"])
    signal.pause()
