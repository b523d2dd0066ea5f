"""The `rems` command: every verb is a few lines over the public API."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from types import FrameType

from rems_net.cli.words import HelpFormatter, warn
from rems_net.errors import AgentError, RemsError, nearest

#: verb -> what it does; each is a module here with `add(parser)` and `run(args)`
VERBS = {
    "demo": "run one Woodbot three ways, and compare",
    "run": "run an experiment from a file",
    "check": "check an experiment without starting anything",
    "new": "write a short file to begin with, which runs at once",
    "parts": "list robots, drivers, inputs, processes, outputs",
    "compare": "compare the robots of a run that is over",
    "list": "who is on the fabric",
    "get": "read values by their key",
    "watch": "follow values as they change",
    "call": "call a method of an agent",
    "clock": "pause, step, resume, change the pace, end",
    "stop": "stop every robot, until released",
    "join": "bring agents to a run on another machine",
}
EXAMPLES = """\
examples:
  rems demo
  rems new robot my_robot     a robot of your own, to begin with
  rems demo --pace 1          then, in another terminal:
  rems list
  rems get 'robot/*/state'
  rems watch robot/kinematic/state
"""

#: verbs that take a script, whose own arguments follow `--`
OF_SCRIPTS = ("run", "check")

#: exit statuses
FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status is 0, or 2 for a mistake in what was
    asked, 1 for a run that failed, 130 after Ctrl+C.
    """
    # Not list(): that is a verb in this package.
    given = [*(sys.argv[1:] if argv is None else argv)]
    words: list[str] = []
    if "--" in given and given[0] in OF_SCRIPTS:
        cut = given.index("--")
        given, words = given[:cut], given[cut + 1 :]
    args = parser(given).parse_args(given)
    args.words = words
    signal.signal(signal.SIGTERM, _terminate)
    try:
        status: int = import_module(f"rems_net.cli.{args.verb}").run(args)
        sys.stdout.flush()
    except AgentError as error:
        warn(error)
        return FAILED
    except RemsError as error:
        warn(error)
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # The reader (`| head`) has gone; Python's own flush at exit must not complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return status


def parser(given: Sequence[str]) -> argparse.ArgumentParser:
    """The parser for these words; only the verbs among them are imported."""
    made = Parser(
        prog="rems",
        description="One robot definition, run as model, simulation and hardware at "
        "once.",
        epilog=EXAMPLES,
        formatter_class=HelpFormatter,
    )
    made.add_argument("--version", action="version", version=_version())
    verbs = made.add_subparsers(dest="verb", metavar="VERB", required=True)
    for verb, doc in VERBS.items():
        sub = verbs.add_parser(
            verb,
            help=doc,
            description=f"{doc[0].upper()}{doc[1:]}.",
            formatter_class=HelpFormatter,
        )
        if verb not in given:
            continue
        module = import_module(f"rems_net.cli.{verb}")
        sub.epilog = module.EXAMPLES
        sub.add_argument(
            "--no-color", action="store_true", help="no colours (or set NO_COLOR)"
        )
        module.add(sub)
    return made


class Parser(argparse.ArgumentParser):
    """argparse, with the nearest right verb in its complaint."""

    def error(self, message: str) -> None:  # type: ignore[override]
        """Say what is wrong, how to get help, and exit with status 2."""
        hint = ""
        if "invalid choice: '" in message:
            came = message.split("invalid choice: '")[1].split("'")[0]
            known = ", ".join(VERBS)
            message = f"there is no verb {came!r}; expected one of {known}."
            hint = nearest(came, VERBS)
        elif not message.endswith("."):
            message += "."
        warn(f"{message}{hint} Type: {self.prog} --help")
        raise SystemExit(BAD_INPUT)


def _version() -> str:
    from rems_net import __version__

    return f"rems {__version__}"


def _terminate(signum: int, frame: FrameType | None) -> None:
    """End as cleanly when told by another program as when told by Ctrl+C."""
    raise KeyboardInterrupt
