"""The system around a command: streams that are closed, and what it refuses."""

import errno
import os
import sys
from pathlib import Path

#: the standard streams, in the order of their numbers
STREAMS = ("stdin", "stdout", "stderr")


def mend_streams() -> None:
    """Let a closed standard stream be as /dev/null, and never fail at a letter.

    Where one is closed, its number is given to the next file that is opened: a
    recording, or a socket, would get what is printed.
    """
    for number, name in enumerate(STREAMS):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
        if getattr(sys, name) is None:
            # A file of its own: its number may have been given away by now.
            nowhere = os.open(os.devnull, os.O_RDWR)
            mode = "r" if name == "stdin" else "w"
            stream = open(nowhere, mode, encoding="utf-8", closefd=False)  # noqa: SIM115
            setattr(sys, name, stream)
    # A file's name may be what no text can hold, or what this terminal can't show.
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors="backslashreplace")


def drop_output() -> None:
    """Nobody takes what was printed: Python's own flush at exit must not complain."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def refusal(error: OSError) -> str:
    """What the system refused, in a sentence."""
    if error.errno in (errno.EMFILE, errno.ENFILE):
        return (
            "This needs more open files than the system gives to one program. Type "
            "`ulimit -n 1024` first, in this terminal."
        )
    if gone := folder_is_gone():
        return gone
    name = f" {error.filename}" if error.filename else ""
    return f"The system refuses{name}: {error.strerror or error}."


def folder_is_gone() -> str:
    """What to do where the working folder was removed; "" where it is there."""
    try:
        Path.cwd()
    except OSError:
        return "The folder in which you are was removed. Go to another one: cd ~"
    return ""
