"""A device's buttons for a logged-in user. Each button asks for confirmation before its command
runs."""

import itertools
from collections.abc import Sequence
from datetime import datetime
from typing import Final, Literal

from fastapi import Request
from nicegui import ui

from workbench.graph.plants import MODES
from workbench.page.actions import Action, Deeds, Local, actions, fail, press, queue
from workbench.page.cards import AGES_S, Cards, Key
from workbench.page.head import part
from workbench.page.local_daemons import LocalDaemons
from workbench.page.login import Login
from workbench.page.tab import Tab
from workbench.page.tables import table

SHOWN_MS: Final = 10_000
LONGEST: Final = 400
MOST_TOLD: Final = 10
ENDED: Final = "You are no longer logged in: nothing was done. This view loads again in a moment."
NO: Final = "No, change nothing"


class Buttons:
    """The buttons of a device. They run the device's actions."""

    def __init__(
        self, cards: Cards, here: LocalDaemons, login: Login, deeds: Deeds, graph: Sequence[str]
    ) -> None:
        self._cards = cards
        self._here = here
        self._login = login
        self._deeds = deeds
        self._graph = graph

    def show(self, key: Key, request: Request, tab: Tab) -> None:
        """Show the device's buttons and recent actions. Show nothing to a user without a login."""
        if not self._login.user(request):
            return
        with ui.element("section").classes("panel").props('aria-label="Actions"'):
            part("<h2>Actions</h2>")
            self._all(key, request)
            self._lately(tab)

    def _lately(self, tab: Tab) -> None:
        """Show recent actions with their users. The latest action comes first."""
        place = part()

        def tell() -> None:
            rows = [
                (f"{datetime.fromtimestamp(one.wall, tab.zone):%X}", one.user, one.text, one.came)
                for one in itertools.islice(self._deeds.latest, MOST_TOLD)
            ]
            told = table(("when", "who", "what", "outcome"), rows, "Done on this page lately")
            place.set_content(told if rows else "")

        tell()
        ui.timer(AGES_S, tell)

    def _all(self, key: Key, request: Request) -> None:
        box = ui.element("div").classes("actions")
        said: list[Sequence[Action]] = []

        def fill() -> None:
            found = self._found(key)
            if said and said[-1] == found:
                return
            said[:] = [found]
            box.clear()
            with box:
                for action in found:
                    self._button(action, request)

        fill()
        ui.timer(AGES_S, fill)
        self._of_kind(key, request)

    def _found(self, key: Key) -> Sequence[Action]:
        shown = self._cards.shown.get(key)
        return actions(shown, self._local(key), self._graph) if shown else ()

    def _local(self, key: Key) -> Local | None:
        served = self._here.serving(key)
        return served.local if served else None

    def _of_kind(self, key: Key, request: Request) -> None:
        if key[0] == "charger":
            with ui.element("div").classes("actions"):
                self._queueing(key[1], request)
        served = self._here.serving(key)
        if served and (served.local.presses or served.local.fails):
            with ui.element("div").classes("actions"):
                self._pressing(served.local, served.device, request)
            with ui.element("div").classes("actions"):
                self._failing(served.local, served.device, request)

    def _queueing(self, charger: str, request: Request) -> None:
        robot = ui.input("Robot (FLEET/ROBOT)").props("dense")
        ui.button(
            "Queue a charge",
            on_click=lambda: self._ask(queue(charger, str(robot.value), self._graph), request),
        )

    def _pressing(self, local: Local, device: str, request: Request) -> None:
        names = list(local.presses)
        signal = ui.select(names, value=names[0], label="Signal").props("dense")

        async def pressed(*, on: bool) -> None:
            await self._ask(press(local, device, str(signal.value), on=on), request)

        ui.button("Press", on_click=lambda: pressed(on=True))
        ui.button("Let go", on_click=lambda: pressed(on=False))

    def _failing(self, local: Local, device: str, request: Request) -> None:
        names = list(local.fails)
        broken = ui.select(names, value=names[0], label="Part").props("dense")
        how = ui.select([*MODES], value=MODES[0], label="fails").props("dense")
        ui.button(
            "Let it fail",
            on_click=lambda: self._ask(
                fail(local, device, str(broken.value), str(how.value)), request
            ),
        )

    def _button(self, action: Action, request: Request) -> None:
        ui.button(action.text, on_click=lambda: self._ask(action, request))

    async def _ask(self, action: Action, request: Request) -> None:
        """Ask the user for confirmation, run the action, and show the outcome."""
        with ui.dialog() as dialog, ui.card():
            dialog.props('aria-label="Are you sure?"')
            ui.label(action.question)
            with ui.row():
                ui.button(action.text, color="negative", on_click=lambda: dialog.submit(True))
                no = ui.button(NO, color=None, on_click=lambda: dialog.submit(False))
                no.props("autofocus").classes("no")
        agreed = await dialog
        dialog.delete()
        if not agreed:
            return
        user = self._login.user(request)
        if not user:
            ui.notify(ENDED, type="warning", timeout=SHOWN_MS)
            ui.run_javascript(f"setTimeout(() => location.reload(), {SHOWN_MS})")
            return
        done = await self._deeds.do(action, user)
        kind: Literal["positive", "negative"] = "positive" if done.code == 0 else "negative"
        ui.notify(done.came[:LONGEST], type=kind, timeout=SHOWN_MS)
