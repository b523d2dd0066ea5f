"""Closed standard streams, and errors of the operating system."""

import errno
import os
import sys
from pathlib import Path
from typing import TextIO

#: the standard streams, in the order of their numbers
STREAMS = ("stdin", "stdout", "stderr")


def mend_streams() -> None:
    """Make a closed standard stream act like /dev/null, and print any character.

    If a stream is closed, the next opened file gets its number: a recording or a socket
    would get the printed text.
    """
    for number, name in enumerate(STREAMS):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
        if getattr(sys, name) is None:
            # A file of its own, since the number may be in use by now.
            nowhere = os.open(os.devnull, os.O_RDWR)
            mode = "r" if name == "stdin" else "w"
            stream = open(nowhere, mode, encoding="utf-8", closefd=False)  # noqa: SIM115
            setattr(sys, name, stream)
    # A file's name may contain characters that this terminal cannot show.
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors="backslashreplace")


def drop_output(stream: TextIO | None = None) -> None:
    """Discard the output, so that Python's own flush at exit does not complain."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), (stream or sys.stdout).fileno())


def reader_has_gone(error: OSError) -> bool:
    """Return whether the output is a pipe that nobody reads any more.

    Windows calls such a pipe an invalid argument.
    """
    invalid = errno.EINVAL, os.strerror(errno.EINVAL)
    is_invalid = sys.platform == "win32" and error.args == invalid
    return is_invalid or isinstance(error, BrokenPipeError)


def refusal(error: OSError) -> str:
    """Return a sentence about what the system refused."""
    if error.errno in (errno.EMFILE, errno.ENFILE):
        return (
            "This needs more open files than the system gives to one program. Type "
            "`ulimit -n 1024` first, in this terminal. (R0614)"
        )
    if gone := folder_is_gone():
        return gone
    name = f" {error.filename}" if error.filename else ""
    return f"The system refuses{name}: {error.strerror or error}. (R0905)"


def folder_is_gone() -> str:
    """Return what to do if the working folder was removed; "" if it exists."""
    try:
        Path.cwd()
    except OSError:
        return "The folder in which you are was removed. Go to another one: cd ~"
    return ""
