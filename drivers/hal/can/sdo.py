"""The canopen library's SDO client, which sends through `canopen.py`. Python imports this file when the
first node is made."""

import logging
import struct
from collections.abc import Callable
from typing import Final

from canopen import ObjectDictionary, SdoAbortedError, SdoCommunicationError
from canopen.sdo.client import SdoClient

ABORT: Final = 0x80

logging.getLogger("canopen").setLevel(logging.CRITICAL)  # HalErrors report its failures


class Client(SdoClient):
    """An SDO client. `exchange` sends eight bytes and returns the eight bytes of the reply. `post`
    sends eight bytes that have no reply.

    Raises ABORTED if the node refuses, and FAILURES for an invalid reply.
    """

    ABORTED = SdoAbortedError
    FAILURES = (SdoCommunicationError, struct.error)

    def __init__(self, exchange: Callable[[bytes], bytes], post: Callable[[bytes], None]) -> None:
        super().__init__(0, 0, ObjectDictionary())  # type: ignore[no-untyped-call]
        self._exchange = exchange
        self._post = post

    def request_response(self, sdo_request: bytes) -> bytes:
        """Make one request. Raises ABORTED and the errors of `exchange`."""
        reply = self._exchange(bytes(sdo_request))
        if reply[0] == ABORT:
            raise SdoAbortedError(int.from_bytes(reply[4:8], "little"))
        return reply

    def send_request(self, request: bytes) -> None:
        """Send a request that has no reply."""
        self._post(bytes(request))
