"""The rows of `hazards.toml`. Each row has an unsafe control action, and the guard in the code against
it.

`python -m tests.reference.hazards [ID …]` removes the guard of each row in a copy of the repository.
Then it runs the row's test, which must fail.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Final

import msgspec

ROOT: Final = Path(__file__).parents[2]
PAGE: Final = ROOT / "docs" / "explanation" / "hazards.md"
BEGIN: Final = "<!-- the table of tests/reference/hazards.toml -->\n"
END: Final = "<!-- end of the table -->\n"


class Cut(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The change that removes a guard from its file."""

    file: str
    cut: str
    put: str


class UnsafeAction(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One row: an unsafe control action with its guard and its test. A row without a guard has a reason
    in `gap`.

    `also` lists further guards. Each guard alone would suffice, so all of them are removed together.
    """

    id: str
    action: str
    leads_to: str
    rule: str = ""
    guard: str = ""
    cut: str = ""
    put: str = ""
    also: list[Cut] = []
    test: str = ""
    gap: str = ""

    @property
    def cuts(self) -> list[Cut]:
        """Return the changes that remove all guards of this row."""
        return [Cut(str(self.file), self.cut, self.put), *self.also]

    @property
    def file(self) -> Path:
        """Return the path of the guard's file, relative to the repository."""
        return Path(self.guard.partition("::")[0])


def actions() -> list[UnsafeAction]:
    """Return every row."""
    rows = tomllib.loads(Path(__file__).with_suffix(".toml").read_text())["action"]
    return msgspec.convert(rows, list[UnsafeAction])


def page() -> str:
    """Return the page of hazards, with its table made from the rows."""
    before, _, rest = PAGE.read_text().partition(BEGIN)
    head = "| action | may lead to | prevented by | proved by |\n|---|---|---|---|\n"
    rows = "".join(_row(action) for action in actions())
    return f"{before}{BEGIN}\n{head}{rows}\n{END}{rest.partition(END)[2]}"


def _row(row: UnsafeAction) -> str:
    first = f"| `{row.id}` {row.action} | {row.leads_to} |"
    if row.gap:
        return f"{first} **gap:** {row.gap} | – |\n"
    function = row.guard.partition("::")[2]
    file, _, test = row.test.partition("::")
    told = re.sub(r"_", " ", test.removeprefix("test_"))
    more = "".join(
        f", and another guard that would suffice alone in `{one.file}`" for one in row.also
    )
    return f"{first} {row.rule}: `{function}` in `{row.file}`{more} | {told} (`{file}`) |\n"


def fails_without(row: UnsafeAction, tree: Path) -> bool:
    """Return whether the row's test passes with the row's guard, and fails without the guard.

    `tree` is a copy of the repository.
    """
    whole = {tree / one.file: (tree / one.file).read_text() for one in row.cuts}
    passes = _exit_code(row.test, tree) == 0
    for one in row.cuts:
        file = tree / one.file
        file.write_text(file.read_text().replace(one.cut, one.put))
    try:
        return passes and _exit_code(row.test, tree) == 1
    finally:
        for file, text in whole.items():
            file.write_text(text)


def _exit_code(test: str, tree: Path) -> int:
    command = [sys.executable, "-B", "-m", "pytest", "-q", "-x", "-n0", "-p", "no:cacheprovider"]
    return subprocess.run([*command, test], cwd=tree, stdout=subprocess.DEVNULL).returncode


def _tried(ids: list[str]) -> int:
    with tempfile.TemporaryDirectory() as scratch:
        tree = Path(scratch) / "tree"
        left = shutil.ignore_patterns(".git", ".venv*", "__pycache__", "build", "*.so")
        shutil.copytree(ROOT, tree, ignore=left)
        survived = 0
        for row in actions():
            if row.gap or (ids and row.id not in ids):
                continue
            fails = fails_without(row, tree)
            sys.stdout.write(f"{row.id} {'fails' if fails else 'SURVIVES'}\n")
            sys.stdout.flush()
            survived += not fails
    return survived


if __name__ == "__main__":
    sys.exit(min(_tried(sys.argv[1:]), 1))
