"""`--help` of every verb has examples, and fits 80 columns."""

import sys

import pytest

from rems_net.cli import main
from rems_net.cli.verbs import COMMANDS, NOUNS, VERBS
from tests.commands import finished


@pytest.mark.parametrize("verb", [*COMMANDS, *NOUNS])
def test_help(capsys: pytest.CaptureFixture[str], verb: str) -> None:
    with pytest.raises(SystemExit) as stop:
        main([*verb.split(), "--help"])
    assert stop.value.code == 0
    said = capsys.readouterr().out
    assert "examples:\n" in said
    assert f"rems {verb}" in said.partition("examples:")[2]
    assert max(map(len, said.splitlines())) <= 80


def test_the_first_help_fits_a_screen(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    said = capsys.readouterr().out
    lines = said.splitlines()
    assert len(lines) <= 51
    assert max(map(len, lines)) <= 80
    assert len(VERBS) <= 16
    first = said.partition("Begin here:\n")[2].partition("\n\n")[0]
    assert len(first.splitlines()) == 10
    for line in first.splitlines()[:-1]:
        assert line.split()[:1] == ["rems"]
        assert line.split()[1] in VERBS


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
    done = finished([sys.executable, "-c", code])
    assert (done.returncode, done.stderr) == (0, "")
