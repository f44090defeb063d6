"""The printed commissioning sheet. Every tick box is on the paper, even with long names and notes."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser

from bridges.cli import main

CONFIG = Path(__file__).parents[4] / "config"
PAGE_PX = 726
"""The width of A4 without two margins of 9 mm, at 96 pixels per inch."""
LONG = "a_very_long_name_of_a_lift_that_somebody_chose_for_the_east_wing_of_building_17"
BEYOND = """() => [...document.querySelectorAll("td.box, th, td")]
  .filter(cell => cell.getBoundingClientRect().right > window.innerWidth + 1)
  .map(cell => cell.textContent)"""


@pytest.mark.parametrize("long", [False, True], ids=["as shipped", "with long names"])
def test_every_cell_of_every_sheet_is_on_the_paper(
    browser: Browser, tmp_path: Path, long: bool
) -> None:
    page = browser.new_page(viewport={"width": PAGE_PX, "height": 1000})
    page.emulate_media(media="print")
    for example in sorted(CONFIG.glob("*_*.yaml")):
        text = example.read_text()
        if text.startswith("rmf_fleet") or "\nrmf_fleet:" in text:
            continue
        file, sheet = tmp_path / example.name, tmp_path / "sheet.html"
        file.write_text(text.replace("Lift1", LONG).replace("charger_a", LONG) if long else text)
        assert main(["check", "-q", "--sheet", str(sheet), str(file)]) == 0
        page.goto(sheet.as_uri())
        assert (example.name, page.evaluate(BEYOND)) == (example.name, [])
        assert page.pdf(prefer_css_page_size=True).startswith(b"%PDF")
    page.close()
