"""The head of every view: its title, links to the others, and the user."""

from html import escape
from typing import Final

from fastapi import Request
from nicegui import ui

from bridges.messages.words import printable
from workbench.page.login import Login

BLUE: Final = "#005a93"
"""The colour of buttons: white text is readable on it in both themes."""
GREEN: Final = "#00674c"
"""The colour of success; on the library's own, white text is unreadable."""
RED: Final = "#b02a00"
"""The colour of failure, and of the button that acts."""


def head(title: str, login: Login, request: Request) -> None:
    """Make the head of a view."""
    ui.dark_mode(None)
    ui.colors(primary=BLUE, positive=GREEN, negative=RED)
    ui.page_title(f"{printable(title)} · RMF bridges")
    who = login.form(request, login.user(request))
    links = '<a href="/">Site</a><a href="/incidents">Incidents</a><a href="/days">Day and week</a>'
    skip = '<a class="skip" href="#main">To the content</a>'
    links = f'<nav aria-label="Page">{links}</nav><span class="zone"></span>'
    html = f"{skip}<h1>{escape(title)}</h1>{links}{who}"
    ui.html(html, sanitize=False, tag="header").classes("top")


def main(style: str = "") -> ui.element:
    """Make the content of a view; the library puts it into its `main`."""
    return ui.element("div").props("id=main").classes(style)


def part(html: str = "", style: str = "") -> ui.html:
    """Make a part whose content is replaced later. `html`: our own markup with every text escaped."""
    return ui.html(html, sanitize=False).classes(style)
