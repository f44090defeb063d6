"""Connections that have waited too long without a request."""

from workbench.page.idle_connections import MOST_SILENT_S, Silent


def test_an_idle_connection_is_listed_after_a_while_and_a_closed_one_is_forgotten() -> None:
    silent = Silent()
    assert silent.too_long(["a", "b"], 0.0) == []
    assert silent.too_long(["a", "c"], MOST_SILENT_S) == []
    assert silent.too_long(["a", "b", "c"], MOST_SILENT_S + 0.1) == ["a"]
    assert silent.too_long(["b", "c"], 2 * MOST_SILENT_S + 0.05) == ["c"]
