"""A program that writes the expected texts again: `python -m tests.workbench.explain [NAME …]`."""

import logging
import sys

from tests.workbench.explain.situations import SCENES
from tests.workbench.explain.test_sentences import GOLDEN, told

logging.disable(logging.CRITICAL)
for name in sys.argv[1:] or SCENES:
    (GOLDEN / f"{name}.txt").write_text("\n".join(told(name)) + "\n", encoding="utf-8")
