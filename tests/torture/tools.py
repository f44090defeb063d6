"""Attacks on the web page, and on the tools that read recordings."""

import random
import threading
import time
from pathlib import Path
from typing import Final

import zstandard

from hal_fakes.domain import domain_for_a_while
from hal_fakes.wire import join
from tests.blackbox.mutants import Mutator, endings
from tests.torture.table import Table
from tests.waiting import wait_until
from tests.workbench.page.browser.conftest import PASSWORD, USER, on_graph, page
from tests.workbench.page.browser.test_bad_days import page_pid, rss_mb
from tests.workbench.page.browser.test_safety import ask
from tests.workbench.page.strangers import half_requests, long_names, strange_frames
from tests.workbench.replay.test_hostile_bags import chunk, record
from workbench.page import access, incidents
from workbench.replay.mcap_read import MAGIC

UNIT_MB: Final = 256
MOST_LINES: Final = 20


def pages(directory: Path, rng: random.Random, table: Table) -> None:
    """Attack the page with half requests, with strange frames, and with graph messages that contain
    names of 1 MB."""
    directory.mkdir()
    access.add_user(directory / "passwords", USER, PASSWORD)
    log = directory / "log"
    with domain_for_a_while() as domain:
        words = ("--passwords", str(directory / "passwords"))
        with page(*on_graph(domain), *words, log=log) as address:
            for body, what in ((True, "bodies"), (False, "heads after a request")):
                with half_requests(address, 250, body=body):
                    wait_until(
                        lambda: ask(address, "/favicon.ico")[0] == 200, "the page answers", 60.0
                    )
                table.count(f"half {what} to the page", "others were answered", 250)
            sent = strange_frames(address, rng, 300)
            table.count("frames of no browser to the page", "served on", sent)
            most = _memory(address, domain)
            assert most < UNIT_MB, most
            table.count("names of 1 MB on the page's graph", f"{most:.0f} MB of {UNIT_MB}", 23 * 20)
    said = log.read_text()
    assert "Traceback" not in said, said
    assert said.count("\n") < MOST_LINES, said


def _memory(address: str, domain: int) -> float:
    pid, forger = page_pid(address), join("forger", domain)
    most = 0.0
    for _ in long_names(forger, 20, 999_000):
        threading.Event().wait(0.5)
        most = max(most, rss_mb(pid))
    forger.close()
    return most


def recordings(directory: Path, seed: int, times: int, table: Table) -> None:
    """Read recordings with wrong content. Also read a small file that unpacks to very much data."""
    for ending, number in endings(Mutator(seed), times, directory).items():
        command, _, code = ending.partition(": ")
        table.count(f"wrong recordings, {command}", f"exit code {code}", number)
    tiny = record(0x80, b"") * ((64 << 20) // 9)
    bomb = directory / "bomb.mcap"
    bomb.write_bytes(MAGIC + chunk(b"zstd", zstandard.compress(tiny), len(tiny)))
    began = time.monotonic()
    found = incidents.read(bomb, {})
    assert "unpacks to more than" in found.notes[0], found.notes
    took = f"refused after {time.monotonic() - began:.1f} s"
    table.count(f"an MCAP file of {bomb.stat().st_size} bytes that unpacks to 64 MB", took)
