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
from rems_net.cli.system import (
    drop_output,
    folder_is_gone,
    mend_streams,
    reader_has_gone,
    refusal,
)
from rems_net.cli.verbs import (
    AWAY,
    COMMANDS,
    MORE,
    NOUNS,
    OF_SCRIPTS,
    OTHERS,
    RARE,
    VERBS,
)
from rems_net.errors import AgentError, ExperimentError, RemsError, longer, nearest
from rems_net.system.window import interrupt_at_close

#: beginning of `rems --help`: ten lines that a beginner can type one by one
FIRST = """\
Begin here:
  rems demo                       one robot, driven in three ways, compared
  rems new robot my_robot         write a robot of your own: my_robot.py
  rems run my_robot.py            run it
  rems plot runs/my_robot         draw what it did
  rems demo --pace 0.1            slowly; then, in another terminal:
  rems list                       who is there
  rems watch robot/kinematic/state
  rems stop                       stop every robot
  rems show                       what robots, drivers and inputs there are
  rems VERB --help                more, with examples
"""

#: exit statuses
FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status.

    It is 0, 2 for a mistake in the command, 1 for a run that failed, 130 after Ctrl+C.
    """
    try:
        mend_streams()
        # Not list(): this package has a verb of this name.
        given = [*(sys.argv[1:] if argv is None else argv)] or ["--help"]
        if given[0] == "help":
            given = [*given[1:], "--help"]
        words: list[str] = []
        if "--" in given and _command(given) in OF_SCRIPTS:
            cut = given.index("--")
            given, words = given[:cut], given[cut + 1 :]
        if argv is None and given[0] in ("run", "rerun"):
            start_pinned(given)
        args = parser(given).parse_args(given)
        args.words, args.command = words, _command(given)
        if args.command in AWAY:
            import_module("rems_net.cli.options").say_where(getattr(args, "at", ""))
        interrupt_at_close()
        for name in ("SIGTERM", "SIGHUP", "SIGBREAK"):  # each system lacks one
            sign = getattr(signal, name, None)
            if sign and signal.getsignal(sign) != signal.SIG_IGN:  # as by nohup
                signal.signal(sign, _terminate)
        with import_module("rems_net.events").listening(_show):
            status: int = module_of(args.command).run(args)
        sys.stdout.flush()
    except AgentError as error:
        return _fail(FAILED, str(error))
    except RemsError as error:
        # Relative names have no meaning in a folder that was removed.
        gone = folder_is_gone() if isinstance(error, ExperimentError) else ""
        return _fail(BAD_INPUT, longer(error, gone and f" {gone}"))
    except KeyboardInterrupt:
        if argv is None:
            # A second Ctrl+C now would print Python's traceback.
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            try:
                sys.stdout.flush()
            except OSError:
                drop_output()  # the terminal's window was closed
        return INTERRUPTED
    except OSError as error:
        if reader_has_gone(error):  # as with `| head`
            drop_output()
            return 0
        few = error.errno in (errno.EMFILE, errno.ENFILE)
        if not few:
            drop_output()  # a full disk would be reported twice
        asked = few or folder_is_gone()
        return _fail(BAD_INPUT if asked else FAILED, refusal(error))
    return status


def _show(event: Any) -> None:
    """Print an event of this program, or of an agent in it."""
    text = event if event.agent else f"rems: {event.text}"
    print(text, file=sys.stderr, flush=True)


def _terminate(signum: int, frame: FrameType | None) -> None:
    """End as cleanly on another program's signal as on Ctrl+C."""
    raise KeyboardInterrupt


def _fail(status: int, sentence: str) -> int:
    try:
        print(f"rems: {sentence}", file=sys.stderr, flush=True)
    except OSError:
        drop_output(sys.stderr)  # the terminal's window was closed
    return status


def _command(given: Sequence[str]) -> str:
    """Return the verb of these words, or the noun and its verb."""
    words = [word for word in given if not word.startswith("-")][:2]
    return " ".join(words if words[:1] and words[0] in NOUNS else words[:1])


def parser(given: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser for these words; only the verbs among them are imported."""
    # Imported here, as all that takes time: Ctrl+C works from the start.
    from rems_net.cli.options import HelpFormatter

    made = Parser(
        prog="rems",
        usage="rems VERB ... | rems NOUN VERB ...",
        description=f"One robot definition, run as model, simulation and hardware.\n\n"
        f"{FIRST}",
        epilog=_nouns(),
        formatter_class=HelpFormatter,
    )
    made.add_argument("--version", action="version", version=f"rems {__version__}")
    tops = made.add_subparsers(
        dest="top", metavar="VERB", title="verbs", prog="rems", required=True
    )
    for verb, doc in {**VERBS, **RARE}.items():
        _fill(_sub(tops, verb, doc, listed=verb in VERBS), verb, given)
    for noun, verbs in NOUNS.items():
        group = _sub(tops, noun, f"{', '.join(verbs)}", listed=False)
        if noun in given:
            each = group.add_subparsers(dest="verb", metavar="VERB", required=True)
            group.epilog = "\n".join(
                f"  rems {noun} {verb} --help" for verb in verbs
            ).join(("examples:\n", "\n"))
            for verb, doc in verbs.items():
                _fill(_sub(each, verb, doc, listed=True), f"{noun} {verb}", given)
    return made


def _sub(verbs: Any, name: str, doc: str, *, listed: bool) -> argparse.ArgumentParser:
    from rems_net.cli.options import HelpFormatter

    shown = {"help": doc} if listed else {}
    made: argparse.ArgumentParser = verbs.add_parser(
        name,
        description=f"{doc[0].upper()}{doc[1:]}.",
        formatter_class=HelpFormatter,
        **shown,
    )
    return made


def _fill(sub: argparse.ArgumentParser, command: str, given: Sequence[str]) -> None:
    """Give a verb its arguments, if it is the one that was typed."""
    if not {*command.split()} <= {*given}:
        return
    module = module_of(command)
    sub.epilog = module.EXAMPLES
    sub.add_argument(
        "--no-color", action="store_true", help="no colours (or set NO_COLOR)"
    )
    module.add(sub)


def _nouns() -> str:
    """Return the nouns with their verbs, a line each."""
    lines = [f"  rems {noun:8}{' '.join(verbs)}" for noun, verbs in NOUNS.items()]
    more = [f"  of {subject:12}{' '.join(verbs)}" for subject, verbs in MORE.items()]
    return "\n".join(
        ["nouns, each with verbs of its own:", *lines, "more verbs:", *more, ""]
    )


def module_of(command: str) -> ModuleType:
    """Return the module of a command: of its verb, or of its noun and verb."""
    noun, _, verb = command.partition(" ")
    name = noun if noun == "clock" or not verb else f"{noun}.{verb}"
    return import_module(f"rems_net.cli.{name}")


class Parser(argparse.ArgumentParser):
    """Parser of the command line; its errors suggest the nearest verb or option."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse, and report unknown arguments with the options of the verb."""
        found, rest = super().parse_known_args(args, namespace)
        if rest:
            what = "option" if rest[0].startswith("-") else "place for"
            hint = nearest(rest[0].partition("=")[0], self._option_string_actions)
            self.error(f"{self.prog} has no {what} {rest[0]!r}.{hint}")
        return found, rest

    def error(self, message: str) -> None:  # type: ignore[override]
        """Print what is wrong and how to get help, and exit with status 2."""
        if message.startswith("argument VERB: invalid choice: '"):
            came = message.split("invalid choice: '")[1].split("'")[0]
            sentence = f"{_no_verb(self.prog, came)} Type: {self.prog} --help (R0903)"
        else:
            end = "" if message[-1] in ".?" else "."
            sentence = f"{message}{end} Type: {self.prog} --help (R0902)"
        raise SystemExit(_fail(BAD_INPUT, sentence))


def _no_verb(prog: str, came: str) -> str:
    """Return the sentence about an unknown verb; prog: `rems`, or with a noun."""
    noun = prog.partition(" ")[2]
    known = NOUNS[noun] if noun else {**VERBS, **NOUNS, **RARE}
    elsewhere = [c for c in COMMANDS if c.split()[-1] == came]
    hint = nearest(came, known)
    if noun == "agent" and came in ("input", "robot", "process", "output"):
        hint = f" Did you mean: rems agent start {came}?"
    elif elsewhere:
        hint = f" Did you mean: rems {elsewhere[0]}?"
    elif came in OTHERS:
        hint = f" Did you mean: rems {OTHERS[came]}?"
    return f"{prog} has no verb {came!r}; it has {', '.join(known)}.{hint}"
