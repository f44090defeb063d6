"""docs/how-to/judge.md has the laws as the code has them."""

from pathlib import Path

import pytest

from bridges.cli import main
from workbench.judge.judge import KINDS, LAWS, Kind
from workbench.judge.report import markdown

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "judge.md"


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_has_every_law_as_it_is(kind: Kind) -> None:
    """If this fails: put what `rmf-bridge judge KIND --laws` prints below its comment."""
    assert f"<!-- rmf-bridge judge {kind} --laws -->\n\n{markdown(kind)}\n" in PAGE.read_text(
        "utf-8"
    )


@pytest.mark.parametrize("kind", KINDS)
def test_each_law_is_a_sentence_with_a_reason_and_a_source(
    kind: Kind, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["judge", kind, "--laws"]) == 0
    assert capsys.readouterr().out == markdown(kind) + "\n"
    laws = LAWS[kind]
    assert len({law.id for law in laws}) == len(laws)
    assert all(law.sentence and law.reason and law.source for law in laws)
    assert not [law for law in laws if "|" in law.sentence + law.reason + law.source]
