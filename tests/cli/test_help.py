"""`--help` of every verb has examples, and fits 80 columns."""

from __future__ import annotations

import subprocess
import sys

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


@pytest.mark.parametrize(
    ("typed", "asked"), [([], ["--help"]), (["help", "run"], ["run", "--help"])]
)
def test_help_is_found(
    capsys: pytest.CaptureFixture[str], typed: list[str], asked: list[str]
) -> None:
    for words in (typed, asked):
        with pytest.raises(SystemExit) as stop:
            main(words)
        assert stop.value.code == 0
    said = capsys.readouterr().out
    assert said == said[: len(said) // 2] * 2


def test_only_what_a_verb_needs_is_imported() -> None:
    """`rems --version` and the like do not wait for what runs experiments."""
    code = (
        "import sys; from rems_net.cli import parser; parser(['--version']); "
        "heavy = {'numpy', 'zenoh', 'rems_net.cli.run'} & sys.modules.keys(); "
        "sys.exit(f'imported {heavy}' if heavy else 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
