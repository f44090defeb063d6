"""Resources that must not grow during a day: threads, file descriptors, objects and memory."""

import gc
import os
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

PAGE = os.sysconf("SC_PAGE_SIZE")
WARM_UP = 2
"""The number of hourly measurements to skip. In these hours caches, queues and the laws' logs grow to
their full size."""
MOST_OBJECTS = 1.05
MOST_MB = 4.0


@dataclass(frozen=True)
class Look:
    """The resources that this test's process uses at one simulated hour."""

    hour: float
    threads: int
    descriptors: int
    objects: int
    rss_mb: float

    def __str__(self) -> str:
        return (
            f"{self.hour:5.1f} h  {self.threads} threads  {self.descriptors} descriptors"
            f"  {self.objects} objects  {self.rss_mb:.1f} MB"
        )


def look(hour: float) -> Look:
    """Free all unused objects, and return the resources in use."""
    gc.collect()
    rss_mb = int(Path("/proc/self/statm").read_text().split()[1]) * PAGE / 1e6
    descriptors = len(os.listdir("/proc/self/fd"))
    return Look(hour, threading.active_count(), descriptors, len(gc.get_objects()), rss_mb)


def growth(looks: Sequence[Look]) -> list[str]:
    """Return a sentence for each resource that grew after the warm-up."""
    if len(looks) <= WARM_UP:
        return []
    first, found = looks[WARM_UP - 1], []
    last = looks[-1]
    if last.threads > first.threads:
        found.append(f"threads: {first.threads} to {last.threads}")
    if last.descriptors > first.descriptors:
        found.append(f"descriptors: {first.descriptors} to {last.descriptors}")
    if last.objects > first.objects * MOST_OBJECTS:
        found.append(f"objects: {first.objects} to {last.objects}")
    if last.rss_mb > first.rss_mb + MOST_MB:
        found.append(f"memory: {first.rss_mb:.1f} to {last.rss_mb:.1f} MB")
    return found
