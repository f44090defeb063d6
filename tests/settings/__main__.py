"""`python -m tests.settings` prints each mistake of `mistakes.toml` with the outcome of `check`."""

from pathlib import Path
from tempfile import TemporaryDirectory

from tests.settings.test_mistakes import MISTAKES, unlike

wrong = 0
with TemporaryDirectory() as folder:
    for mistake in MISTAKES:
        found = unlike(mistake, Path(folder))
        wrong += found != ""
        print(f"{'-' if found else 'ok':3} {mistake['name']}: {found or mistake['what']}")
print(f"{len(MISTAKES) - wrong} of {len(MISTAKES)} as their author expects")
