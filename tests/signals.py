"""Signals that tests send to processes, on every system."""

import os
import signal
import sys

#: ends a process at once; on Windows `os.kill` does so for SIGTERM, too
KILL: signal.Signals = getattr(signal, "SIGKILL", signal.SIGTERM)
#: how rems_net reports a process that ended so
KILLED = "killed by signal 9" if os.name == "posix" else "exited with status 15"

if sys.platform == "win32":
    from ctypes import WinDLL, c_void_p
    from ctypes.wintypes import HANDLE

    _SUSPEND_RESUME = 0x0800

    def _call(function: str, pid: int) -> None:
        """Give a process to a function of ntdll.dll. Raises ProcessLookupError."""
        kernel, system = WinDLL("kernel32"), WinDLL("ntdll")
        kernel.OpenProcess.restype = HANDLE
        handle = kernel.OpenProcess(_SUSPEND_RESUME, False, pid)
        if not handle:
            raise ProcessLookupError(f"there is no process {pid}")
        status = getattr(system, function)(c_void_p(handle))
        kernel.CloseHandle(c_void_p(handle))
        if status:
            raise ProcessLookupError(f"{function} of process {pid} failed: {status:x}")

    def freeze(pid: int) -> None:
        """Stop a process where it is; `thaw` lets it go on."""
        _call("NtSuspendProcess", pid)

    def thaw(pid: int) -> None:
        """Let a frozen process go on."""
        _call("NtResumeProcess", pid)

else:

    def freeze(pid: int) -> None:
        """Stop a process where it is; `thaw` lets it go on."""
        os.kill(pid, signal.SIGSTOP)

    def thaw(pid: int) -> None:
        """Let a frozen process go on."""
        os.kill(pid, signal.SIGCONT)
