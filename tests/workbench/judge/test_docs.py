"""The laws in the output of `rmf-bridge judge KIND --laws` and in docs/reference/laws.md."""

import pytest

from bridges.cli import main
from workbench.judge.judge import KINDS, LAWS, JudgedKind
from workbench.judge.report import markdown


@pytest.mark.parametrize("kind", KINDS)
def test_each_law_is_a_sentence_with_a_reason_and_a_source(
    kind: JudgedKind, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["judge", kind, "--laws"]) == 0
    assert capsys.readouterr().out == markdown(kind) + "\n"
    laws = LAWS[kind]
    assert len({law.id for law in laws}) == len(laws)
    assert all(law.sentence and law.reason and law.source for law in laws)
    assert not [law for law in laws if "|" in law.sentence + law.reason + law.source]
