"""The page of `make demo-page`. The page opens at the printed address, and accepts the printed
password."""

from pathlib import Path
from urllib.parse import urlsplit

import pytest

from hal_fakes.demo.daemons import PageProcess, stop_all
from tests.workbench.page.browser.test_safety import FORM, ask, form

pytestmark = pytest.mark.browser


def test_the_printed_address_opens_whatever_the_page_logs_before_it(
    tmp_path: Path, module_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PAGE_PORT", "0")
    monkeypatch.delenv("PYTEST_CURRENT_TEST")
    page = PageProcess(tmp_path, module_domain, "correct horse")
    try:
        said = page.address()
        assert said.startswith("the page is at http://127.0.0.1:")
        address = said.split()[4]
        assert urlsplit(address).port
        assert ask(address, "/login", FORM, form("demo", "correct horse"))[0] == 303
    finally:
        stop_all([page])
