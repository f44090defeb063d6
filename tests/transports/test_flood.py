"""A log that stays short while a stranger sends many datagrams."""

import os
import socket
import struct
import subprocess
import sys
from pathlib import Path

from tests.waiting import PATIENCE_S

NODE = """
import sys
from bridges.system import log
from bridges.transports.dds.transport import DdsTransport
log.start()
node = DdsTransport("node", int(sys.argv[1]), loopback=True)
print("joined", flush=True)
sys.stdin.read()
node.close()
"""
GUID = bytes(range(12))


def _malformed(kind: int, length: int) -> bytes:
    header = b"RTPS\x02\x01\x01\x10" + GUID
    return header + struct.pack("<BBH", kind, 5, length) + b"\xa5" * length


def test_malformed_datagrams_do_not_each_cause_a_log_line(domain: int, tmp_path: Path) -> None:
    log = tmp_path / "log"
    command = [sys.executable, "-c", NODE, str(domain)]
    with (
        log.open("wb") as err,
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=err
        ) as node,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        assert node.stdout
        assert node.stdout.readline() == b"joined\n"
        for _ in range(1000):
            for packet in (_malformed(0x15, 20), _malformed(0x06, 8), _malformed(0x07, 24)):
                for port in (10, 11):
                    sender.sendto(packet, ("127.0.0.1", 7400 + 250 * domain + port))
        assert node.stdin
        node.stdin.close()
        assert node.wait(PATIENCE_S) == 0
    assert log.read_text().splitlines() == []


def test_each_line_of_a_library_is_logged_once_and_every_line_of_ours(tmp_path: Path) -> None:
    text = (
        "import logging; from bridges.system import log; log.start()\n"
        "for n in range(3):\n"
        "    logging.getLogger('pymodbus').warning('bad frame %s', n, exc_info=ValueError())\n"
        "    logging.getLogger('bridges.runtime').warning('ours %s', n)\n"
    )
    env = {**os.environ, "JOURNAL_STREAM": "1"}
    said = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, env=env)
    first = '<4>library logger=pymodbus text="bad frame 0"'
    assert said.stderr.splitlines() == [first, "<4>ours 0", "<4>ours 1", "<4>ours 2"]
