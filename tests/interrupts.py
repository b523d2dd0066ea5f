"""Ctrl+C for processes that tests start, on every system."""

import os
import signal
import subprocess
import sys
from typing import Any

#: exit statuses of a program that ends by Ctrl+C: by the signal, or as shells return it
INTERRUPTED = (-signal.SIGINT, 130, 0xC000013A)

if sys.platform == "win32":
    #: how a process is started that is to get Ctrl+C alone: in a console of its own
    APART: dict[str, Any] = {"creationflags": subprocess.CREATE_NO_WINDOW}
    #: Ctrl+C goes to a console, and a process has one console only.
    _SEND = """
import ctypes, sys
kernel = ctypes.WinDLL("kernel32")
kernel.FreeConsole()
ok = kernel.AttachConsole(int(sys.argv[1])) and kernel.SetConsoleCtrlHandler(None, 1)
sys.exit(not (ok and kernel.GenerateConsoleCtrlEvent(0, 0)))
"""

    def interrupt(process: "subprocess.Popen[str]") -> None:
        """Send Ctrl+C to a process, and to all that share its console."""
        words = [sys.executable, "-S", "-c", _SEND, str(process.pid)]
        done = subprocess.run(words, stdin=subprocess.DEVNULL, check=False)
        assert done.returncode == 0 or process.wait(5) is not None, process.args

    interrupt_all = interrupt

else:
    #: how a process is started that is to get Ctrl+C alone: in a group of its own
    APART: dict[str, Any] = {"start_new_session": True}

    def interrupt(process: "subprocess.Popen[str]") -> None:
        """Send Ctrl+C to a process."""
        process.send_signal(signal.SIGINT)

    def interrupt_all(process: "subprocess.Popen[str]") -> None:
        """Send Ctrl+C to a process and all in its group, as a terminal does."""
        os.killpg(process.pid, signal.SIGINT)
