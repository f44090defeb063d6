"""`python -m tests.settings` runs `check` on each example in `mistakes.toml`. It prints whether `check`
does what the example's author expects."""

from pathlib import Path
from tempfile import TemporaryDirectory

from tests.settings.test_mistakes import MISTAKES, unlike

wrong = 0
with TemporaryDirectory() as folder:
    for mistake in MISTAKES:
        found = unlike(mistake, Path(folder))
        wrong += found != ""
        print(f"{'-' if found else 'ok':3} {mistake['name']}: {found or mistake['what']}")
print(f"check treats {len(MISTAKES) - wrong} of {len(MISTAKES)} mistakes as their author expects")
