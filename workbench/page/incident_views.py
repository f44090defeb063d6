"""The views of recordings. One view lists the folder. Another view shows one recording with its
explanation and timeline."""

import asyncio
from collections.abc import Iterator
from datetime import tzinfo
from html import escape
from pathlib import Path
from typing import Final
from urllib.parse import quote

from fastapi import Request, Response
from fastapi.responses import FileResponse
from nicegui import Client, app, ui

from bridges.messages.words import printable
from workbench.explain.picture import svg
from workbench.page import incidents
from workbench.page.drawing import when
from workbench.page.explanation_html import explanation, story, timeline
from workbench.page.head import head, main, part
from workbench.page.login import Login
from workbench.page.zone import LONGEST as LONGEST_ZONE
from workbench.page.zone import zone_of

ANSWERS_S: Final = 10.0
"""Maximum time (s) for a browser to name its time zone."""
FILTER: Final = (
    '<div class="filters"><label>Find a device, reason or day'
    ' <input id="find" type="search"></label></div>'
)


class IncidentViews:
    """The views of the recordings in a folder. If `recording` is given, the start page shows this
    file."""

    def __init__(self, folder: Path, recording: Path | None, login: Login) -> None:
        self._folder = folder
        self._recording = recording
        self._login = login
        self._one_at_a_time = asyncio.Lock()

    def install(self) -> None:
        """Register the views' addresses."""
        if self._recording is not None:
            ui.page("/", title=self._recording.name)(self.alone)
        ui.page("/incidents", title="Incidents")(self.all)
        ui.page("/incidents/{name}", title="Incident")(self.one)
        app.get("/incidents/{name}/file")(self.download)

    def all(self, request: Request) -> None:
        """Show the list of recordings."""
        head("Incidents", self._login, request)
        with main():
            part(self._list())

    async def one(self, name: str, request: Request, client: Client) -> Response | None:
        """Show a recording of the folder."""
        found = self._file(name)
        head(found.title if found else name, self._login, request)
        if found is None:
            with main():
                part("<p>There is no incident with this name.</p>")
            return client.build_response(request, 404)
        await self._view(self._folder / name, client, _about(found) + _download(name))
        return None

    async def alone(self, request: Request, client: Client) -> None:
        """Show the single recording that the command line named."""
        assert self._recording is not None
        head(self._recording.name, self._login, request)
        await self._view(self._recording, client)

    def download(self, name: str) -> Response:
        """Send the recording's file."""
        if self._file(name) is None:
            return Response("there is no incident with this name", status_code=404)
        path = self._folder / name
        return FileResponse(path, filename=name, media_type="application/octet-stream")

    def _file(self, name: str) -> incidents.File | None:
        try:
            return incidents.file_in(self._folder, name)
        except OSError:
            return None

    def _list(self) -> str:
        try:
            items = "".join(map(_item, incidents.listed(self._folder)))
        except OSError as error:
            return (
                f"<p>{escape(f'{self._folder}: {error.strerror}. No incident can be shown.')}</p>"
            )
        if not items:
            return "<p>There are no incidents.</p>"
        return f'{FILTER}<ul class="incidents">{items}</ul>'

    async def _view(self, path: Path, client: Client, link: str = "") -> None:
        """Show an empty view immediately, because reading the recording may take long. After the
        reading, fill the view."""
        with main():
            box = part('<p role="status">The recording is being read …</p>')
        await client.connected()
        async with self._one_at_a_time:
            if client.is_deleted:
                return
            try:
                zone = await client.run_javascript("ZONE", timeout=ANSWERS_S)
                found = await incidents.read_apart(path, str(zone)[:LONGEST_ZONE])
            except incidents.BagError as error:
                box.set_content(f"<p>{escape(str(error))}</p>")
                return
        box.set_content(link + "".join(_told(found, zone_of(zone))))


def _address(name: str) -> str:
    return f"/incidents/{quote(name, safe='', errors='replace')}"


def _item(one: incidents.File) -> str:
    file = printable(one.name)
    link = f'<a href="{_address(one.name)}">{escape(one.title)}</a>'
    if not one.name.isprintable():
        link = f"<span>{escape(file)}: unprintable name; rename the file to open it here</span>"
    wanted = escape(f"{one.title if one.device else file}".lower())
    return f'<li class="panel" data-find="{wanted}">{when(one.wall)}{link}{_file_of(one)}</li>'


def _file_of(one: incidents.File) -> str:
    return f'<span class="file">{escape(printable(one.name))}, {one.size / 1024:.0f} KiB</span>'


def _about(one: incidents.File) -> str:
    """Return the HTML of an incident's time and file name."""
    return f'<p class="about">{when(one.wall)} {_file_of(one)}</p>'


def _download(name: str) -> str:
    return f'<p><a href="{_address(name)}/file">Download the recording (MCAP)</a></p>'


def _told(found: incidents.ExplainedRecording, zone: tzinfo | None) -> Iterator[str]:
    yield "".join(f"<p>{escape(note)}</p>" for note in found.notes)
    yield "".join(f"<p>Kept for: {escape(text)}</p>" for _, text in found.reasons)
    if not found.devices:
        yield "<p>The recording has nothing about RMF's lifts, doors and chargers.</p>"
    for told, drawing in found.devices:
        yield f"<h2>{escape(f'{told.kind} {told.device}')}</h2>"
        yield explanation(told)
        yield f"<details><summary>What happened</summary>{story(told, zone)}</details>"
        yield timeline(svg(drawing, zone=zone), found.opens_at(drawing))
