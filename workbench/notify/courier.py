"""Carry notices to their recipients, each recipient's on a thread of its own."""

import logging
import threading
import time
from collections import deque
from contextlib import suppress
from typing import Final

from bridges.system.log import pairs
from workbench.notify import channels
from workbench.notify.messages import NoticeText
from workbench.notify.settings import Recipient

logger = logging.getLogger(__name__)
RETRY_S: Final = (5.0, 15.0, 60.0)
"""Pauses (s) after failed tries. After the last pause of the list, the program repeats the last
pause."""
MOST_WAITING: Final = 200
"""Maximum number of notices that wait for an unreachable recipient. The program drops the oldest
notices, and logs that."""


class Courier:
    """A sender of one recipient's notices, on a separate thread. A slow recipient delays no other
    recipient's notices."""

    def __init__(self, to: Recipient) -> None:
        self._to = to
        self._waiting: deque[NoticeText] = deque(maxlen=MOST_WAITING)
        self._lock = threading.Lock()
        self._came = threading.Event()
        threading.Thread(target=self._run, name=to.name, daemon=True).start()

    @property
    def waiting(self) -> list[NoticeText]:
        """The notices that the recipient has not taken yet, the oldest first."""
        with self._lock:
            return [*self._waiting]

    def take(self, notice: NoticeText) -> None:
        """Queue a notice, if its severity is high enough for this recipient. A repeat takes the place
        of an earlier repeat that waits."""
        if self._to.least == "critical" and notice.severity != "critical":
            return
        with self._lock:
            same = (notice.event, notice.key)
            if notice.event == "again":
                rest = [one for one in self._waiting if (one.event, one.key) != same]
                self._waiting = deque(rest, maxlen=MOST_WAITING)
            if len(self._waiting) == MOST_WAITING:
                title = self._waiting[0].title
                logger.error(pairs("notice_dropped", to=self._to.name, title=title))
            self._waiting.append(notice)
        self._came.set()

    def _run(self) -> None:
        tries = 0
        while True:
            self._came.wait()
            self._came.clear()
            while waiting := self.waiting:
                tries = 0 if self._sent(waiting[0]) else tries + 1
                if tries:
                    time.sleep(RETRY_S[min(tries, len(RETRY_S)) - 1])
                    continue
                with self._lock, suppress(ValueError):  # a repeat may have taken its place
                    self._waiting.remove(waiting[0])

    def _sent(self, notice: NoticeText) -> bool:
        try:
            channels.send(self._to, notice)
        except channels.ChannelError as error:
            logger.error(pairs("notice_not_taken", to=self._to.name, reason=error))
            return False
        logger.info(pairs("notice", to=self._to.name, what=notice.event, title=notice.title))
        return True
