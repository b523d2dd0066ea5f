"""`rems completion SHELL`: a script, so that Tab completes `rems` in a shell."""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, field

from rems_net.cli.shells import SHELLS
from rems_net.cli.verbs import COMMANDS, NOUNS, RARE, VERBS

EXAMPLES = """\
examples:
  rems completion bash >> ~/.bashrc       then open a new terminal
  rems completion zsh >> ~/.zshrc
  rems completion fish > ~/.config/fish/completions/rems.fish
  rems completion powershell >> $PROFILE
"""


@dataclass
class Words:
    """Words that can follow one command; files can always follow, too.

    options: option -> its effect    values: option with an argument -> its choices
    choices: of the arguments that are no options
    """

    options: dict[str, str] = field(default_factory=dict)
    values: dict[str, list[str]] = field(default_factory=dict)
    choices: dict[str, str] = field(default_factory=dict)


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS)
    )


def run(args: argparse.Namespace) -> int:
    """Print the script."""
    print(SHELLS[args.shell](commands()), end="")
    return 0


def commands() -> dict[str, Words]:
    """Return what can follow each command; that of "" is what follows `rems`."""
    about = {noun: f"{', '.join(verbs)}" for noun, verbs in NOUNS.items()}
    top = {**VERBS, **about, **RARE}
    found = {"": Words({"--help": "show help", "--version": "show the version"})}
    found[""].choices = top
    for noun, verbs in NOUNS.items():
        found[noun] = Words({"--help": "show help"}, choices=dict(verbs))
    for command in COMMANDS:
        found[command] = _words(_parser(command))
    return found


def _parser(command: str) -> argparse.ArgumentParser:
    """Return the parser of one command."""
    from rems_net.cli import parser

    found: argparse.ArgumentParser = parser(command.split())
    for word in command.split():
        verbs = (a.choices for a in _actions(found) if isinstance(a.choices, dict))
        found = next(verbs)[word]
    return found


def _words(parser: argparse.ArgumentParser) -> Words:
    found = Words()
    for action in _actions(parser):
        doc = (action.help or "").replace("%%", "%")
        doc = doc if action.help != argparse.SUPPRESS else ""
        choices = [str(one) for one in action.choices or ()]
        if not action.option_strings:
            found.choices |= dict.fromkeys(choices, doc)
        for option in action.option_strings:
            if option.startswith("--"):
                found.options[option] = doc
                if action.nargs != 0:
                    found.values[option] = choices
    return found


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    # argparse has no public way to list what a parser takes.
    yield from parser._actions
