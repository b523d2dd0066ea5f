"""`rems ...` within this process: sooner, where the end of a process is no matter."""

from __future__ import annotations

import io
import signal
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from rems_net.cli import main
from tests.agents.runs import quiet
from tests.commands import Done


def rems(*words: str, typed: str = "", folder: Path | None = None, **more: str) -> Done:
    """Run `rems words...` to its end, as in a terminal of 80 columns.

    `more` are variables of its environment.
    """
    out, error = io.StringIO(), io.StringIO()
    signs = [getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP")]
    before = {sign: signal.getsignal(sign) for sign in signs if sign}
    with (
        pytest.MonkeyPatch.context() as now,
        redirect_stdout(out),
        redirect_stderr(error),
    ):
        now.setattr(sys, "stdin", io.StringIO(typed))
        now.chdir(folder or Path.cwd())
        for name, value in ({"COLUMNS": "80"} | more).items():
            now.setenv(name, value)
        now.delenv("FORCE_COLOR", raising=False)
        try:
            status = main(words)
        except SystemExit as end:
            status = int(end.code or 0)
        finally:
            for sign, handler in before.items():
                signal.signal(sign, handler)
    said = quiet(error.getvalue())
    return subprocess.CompletedProcess(words, status, out.getvalue(), said)
