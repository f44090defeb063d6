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


def head(title: str, login: Login, request: Request) -> None:
    """The head of a view."""
    ui.dark_mode(None)
    ui.colors(primary=BLUE, positive=GREEN)
    ui.page_title(f"{printable(title)} · RMF bridges")
    who = login.form(request, login.user(request))
    links = '<a href="/">Site</a><a href="/incidents">Incidents</a>'
    skip = '<a class="skip" href="#main">To the content</a>'
    html = f'{skip}<h1>{escape(title)}</h1><nav aria-label="Page">{links}</nav>{who}'
    ui.html(html, sanitize=False, tag="header").classes("top")


def main(style: str = "") -> ui.element:
    """The main part of a view."""
    return ui.element("main").props("id=main").classes(style)


def part(html: str = "", style: str = "") -> ui.html:
    """Make a part whose content is replaced later. `html`: our own markup with every text escaped."""
    return ui.html(html, sanitize=False).classes(style)
