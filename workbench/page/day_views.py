"""A view of what happened at each device in the last day and week, and a CSV file. The numbers come
from the recorder on this machine, which counts events."""

from datetime import date
from pathlib import Path

from fastapi import Request, Response
from nicegui import app, ui

from bridges.blackbox import days
from workbench.page.head import head, main, part
from workbench.page.login import Login
from workbench.page.tables import table

CSV = '<p><a href="/days/csv" download="days.csv">Every day as CSV</a></p>'
NONE = "<p>This machine's recorder has counted nothing in this time.</p>"


class DayViews:
    """Views of the days in the recorder's folder."""

    def __init__(self, folder: Path, login: Login) -> None:
        self._folder = folder
        self._login = login

    def install(self) -> None:
        """Register the views' addresses."""
        ui.page("/days", title="Day and week")(self.show)
        app.get("/days/csv")(self.csv)

    def show(self, request: Request) -> None:
        """Show the last day and the last seven days."""
        head("Day and week", self._login, request)
        found, today = days.read(self._folder), date.today()
        with main():
            for caption, count in (("Today", 1), ("The last 7 days", 7)):
                cells = [row.cells for row in days.rows(found, today, count)]
                part(table(days.HEADINGS, cells, caption) if cells else f"<h2>{caption}</h2>{NONE}")
            part(CSV)

    def csv(self) -> Response:
        """Send the counts of every day as CSV."""
        return Response(days.as_csv(days.read(self._folder)), media_type="text/csv; charset=utf-8")
