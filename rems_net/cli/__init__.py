"""The `rems` command: every verb is a few lines over the public API."""

import argparse
import errno
import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from types import FrameType, ModuleType
from typing import Any

from rems_net import __version__
from rems_net.cli.pinned import start_pinned
from rems_net.cli.system import drop_output, folder_is_gone, mend_streams, refusal
from rems_net.errors import AgentError, ExperimentError, RemsError, nearest

#: verb -> what it does; each is a module here with `add(parser)` and `run(args)`, with
#: `_` for `-` in its name
VERBS = {
    "demo": "run one Woodbot three ways, and compare",
    "run": "run an experiment from a file",
    "check": "check an experiment, and try its first ticks",
    "new": "write a short file to begin with, which runs at once",
    "parts": "list robots, drivers, inputs, processes, outputs",
    "check-robot": "check that a robot does what every robot must",
    "matrix": "robots by drivers: how well they agree, and how fast they are",
    "compare": "compare the robots of a run that is over",
    "plot": "draw a run that is over",
    "list": "who is on the fabric",
    "get": "read values by their key",
    "watch": "follow values as they change",
    "why": "why a value is missing, old or dropped",
    "call": "call a method of an agent",
    "clock": "pause, step, resume, change the pace, end",
    "doctor": "what is wrong between this laptop and a fabric",
    "stop": "stop every robot, until released",
    "serve": "be an open fabric, for a class: a router and a clock",
    "agent": "start agents on an open fabric",
    "emulate": "robots without hardware: Woodbots, or a device at a port",
    "bring": "bring agents to a run on another machine",
    "firmware": "write what a robot's firmware takes from its definition",
    "board": "write a ready image to a robot's board, over its USB cable",
    "join": "use the router of a class from now on",
    "leave": "forget the router of the class",
    "ports": "list serial ports, and what answers there",
    "provision": "tell a robot at the USB cable who it is, and where it belongs",
    "bridge": "let a robot without Wi-Fi on the fabric, over its USB cable",
    "calibrate": "measure a Woodbot's servos, and store it in the robot",
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
OF_SCRIPTS = ("run", "check", "agent")

#: verbs that talk to a fabric, which may be on another machine; `run` may not
AWAY = (
    *("bring", "agent", "emulate", "serve"),
    *("list", "get", "watch", "why", "call", "clock", "stop", "calibrate"),
)

#: what to do instead where somebody looks for a verb that sets a value
SETTING = (
    " A command is set from Python: with rems_net.join() as fabric: "
    'fabric.robot("sim").command["wheel/left"] = 3.0.'
)

#: exit statuses
FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status is 0, or 2 for a mistake in what was
    asked, 1 for a run that failed, 130 after Ctrl+C.
    """
    try:
        mend_streams()
        # Not list(): that is a verb in this package.
        given = [*(sys.argv[1:] if argv is None else argv)] or ["--help"]
        if given[0] == "help":
            given = [*given[1:], "--help"]
        words: list[str] = []
        if "--" in given and given[0] in OF_SCRIPTS:
            cut = given.index("--")
            given, words = given[:cut], given[cut + 1 :]
        if argv is None and given[0] == "run":
            start_pinned(given)
        args = parser(given).parse_args(given)
        args.words = words
        if args.verb in AWAY:
            import_module("rems_net.cli.words").say_where(getattr(args, "at", ""))
        for name in ("SIGTERM", "SIGHUP"):  # Windows has no window that hangs up
            sign = getattr(signal, name, None)
            if sign and signal.getsignal(sign) != signal.SIG_IGN:  # as by nohup
                signal.signal(sign, _terminate)
        with import_module("rems_net.events").listening(_show):
            status: int = module_of(args.verb).run(args)
        sys.stdout.flush()
    except AgentError as error:
        return _fail(FAILED, str(error))
    except RemsError as error:
        # Relative names mean nothing in a folder that was removed.
        gone = folder_is_gone() if isinstance(error, ExperimentError) else ""
        return _fail(BAD_INPUT, f"{error} {gone}".rstrip())
    except KeyboardInterrupt:
        if argv is None:
            # All is over: another one would only be told by Python, with its lines.
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        return INTERRUPTED
    except BrokenPipeError:
        drop_output()  # the reader (`| head`) has gone
        return 0
    except OSError as error:
        few = error.errno in (errno.EMFILE, errno.ENFILE)
        if not few:
            drop_output()  # a full disk would be told once more
        asked = few or folder_is_gone()
        return _fail(BAD_INPUT if asked else FAILED, refusal(error))
    return status


def _show(event: Any) -> None:
    """Show what this program itself reports, or an agent in it."""
    text = event if event.agent else f"rems: {event.text}"
    print(text, file=sys.stderr, flush=True)


def _fail(status: int, sentence: str) -> int:
    print(f"rems: {sentence}", file=sys.stderr, flush=True)
    return status


def parser(given: Sequence[str]) -> argparse.ArgumentParser:
    """The parser for these words; only the verbs among them are imported."""
    # Here, and so is all that takes time: a Ctrl+C is understood from the start.
    from rems_net.cli.words import HelpFormatter

    made = Parser(
        prog="rems",
        description="One robot definition, run as model, simulation and hardware at "
        "once.",
        epilog=EXAMPLES,
        formatter_class=HelpFormatter,
    )
    made.add_argument("--version", action="version", version=f"rems {__version__}")
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
        module = module_of(verb)
        sub.epilog = module.EXAMPLES
        sub.add_argument(
            "--no-color", action="store_true", help="no colours (or set NO_COLOR)"
        )
        module.add(sub)
    return made


def module_of(verb: str) -> ModuleType:
    """The module of a verb."""
    return import_module(f"rems_net.cli.{verb.replace('-', '_')}")


class Parser(argparse.ArgumentParser):
    """argparse, with the nearest right verb or option in its complaint."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Complain here of what is unknown, where the options of the verb are."""
        found, rest = super().parse_known_args(args, namespace)
        if rest:
            what = "option" if rest[0].startswith("-") else "place for"
            hint = nearest(rest[0].partition("=")[0], self._option_string_actions)
            self.error(f"{self.prog} has no {what} {rest[0]!r}.{hint}")
        return found, rest

    def error(self, message: str) -> None:  # type: ignore[override]
        """Say what is wrong, how to get help, and exit with status 2."""
        hint = ""
        if "invalid choice: '" in message:
            came = message.split("invalid choice: '")[1].split("'")[0]
            known = ", ".join(VERBS)
            message = f"there is no verb {came!r}; expected one of {known}."
            hint = SETTING if came in ("set", "put") else nearest(came, VERBS)
        elif message[-1] not in ".?":
            message += "."
        raise SystemExit(_fail(BAD_INPUT, f"{message}{hint} Type: {self.prog} --help"))


def _terminate(signum: int, frame: FrameType | None) -> None:
    """End as cleanly when told by another program as when told by Ctrl+C."""
    raise KeyboardInterrupt
