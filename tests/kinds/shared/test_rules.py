"""A reader who searches for a rule's number finds the rule and its stories.

So every rule must be cited by a test, and every citation must name a rule.
"""

import ast
import re
from pathlib import Path

from bridges import kinds

KINDS, STORIES = Path(kinds.__path__[0]), Path(__file__).parents[1]


def named(module: Path) -> list[str]:
    """Return the names of the rules in a module's docstring. Fail if they do not follow from the
    module's path.

    For example, the rules of lift/core.py are LIFT-1, LIFT-2, … and the rules of lift/drive.py are
    LIFT-DRIVE-1, …
    """
    words = [
        w for w in module.relative_to(KINDS).with_suffix("").parts if w not in ("core", "shared")
    ]
    prefix = "-".join(words).upper().replace("_", "-").replace("CHARGER-COORDINATOR", "COORDINATOR")
    text = ast.get_docstring(ast.parse(module.read_text("utf-8"))) or ""
    found = re.findall(r"^([A-Z-]+-\d+)\. ", text, re.MULTILINE)
    assert found == [f"{prefix}-{number}" for number in range(1, len(found) + 1)]
    return found


def test_every_rule_is_cited_by_a_test_and_every_citation_names_a_rule() -> None:
    of_cores = [named(core) for core in KINDS.glob("*/core.py")]
    assert all(of_cores)
    rules = {rule for module in KINDS.rglob("*.py") for rule in named(module)}
    prefixes = "|".join(sorted({rule.rpartition("-")[0] for rule in rules}))
    texts = [story.read_text("utf-8") for story in STORIES.rglob("test_*.py")]
    assert {
        cited for text in texts for cited in re.findall(rf"\b(?:{prefixes})-\d+\b", text)
    } == rules
