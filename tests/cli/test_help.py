"""`--help` of every verb has examples, and fits 80 columns."""

from __future__ import annotations

import pytest

from rems_net.cli import VERBS, main


@pytest.mark.parametrize("verb", VERBS)
def test_help(capsys: pytest.CaptureFixture[str], verb: str) -> None:
    with pytest.raises(SystemExit) as stop:
        main([verb, "--help"])
    assert stop.value.code == 0
    said = capsys.readouterr().out
    assert "examples:\n" in said
    assert f"rems {verb}" in said.partition("examples:")[2]
    assert max(map(len, said.splitlines())) <= 80
