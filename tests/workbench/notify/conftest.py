"""A fixture: the server that receives notices."""

import threading
from collections.abc import Iterator

import pytest

from tests.workbench.notify.sink import Sink


@pytest.fixture
def sink() -> Iterator[Sink]:
    with Sink() as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server
        server.shutdown()
