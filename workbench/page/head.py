"""The head of every view, with a title, links to the other views, and the user."""

from html import escape
from typing import Final

from fastapi import Request
from nicegui import ui

from bridges.messages.words import printable
from workbench.page.login import Login

BLUE: Final = "#005a93"
"""Colour of buttons. White text is readable on this colour in both themes."""
GREEN: Final = "#00674c"
"""Colour of success. White text would be unreadable on the green of the library (NiceGUI)."""
RED: Final = "#b02a00"
"""Colour of a failure. The button that confirms an action has this colour too."""


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
    """Make the content of a view. The library (NiceGUI) puts the content inside its own `main`
    element."""
    return ui.element("div").props("id=main").classes(style)


def part(html: str = "", style: str = "") -> ui.html:
    """Make a part of a view that the page replaces later. `html` is our own markup, in which every text
    is escaped."""
    return ui.html(html, sanitize=False).classes(style)
