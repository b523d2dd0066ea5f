"""A terminal's window that is closed on Windows: the program ends in order.

Other systems send SIGHUP. Windows calls a function in a thread of its own, and ends the
program as soon as that returns, or after five seconds; so it does at a log-off.
Source: Microsoft's documentation of SetConsoleCtrlHandler and HandlerRoutine.
"""

import sys
import threading
from _thread import interrupt_main

#: s. The end of a program may take this long.
ENDING = 4.5

if sys.platform == "win32":
    import ctypes
    from ctypes import wintypes

    #: CTRL_CLOSE_EVENT, CTRL_LOGOFF_EVENT and CTRL_SHUTDOWN_EVENT
    _CLOSED = (2, 5, 6)

    @ctypes.WINFUNCTYPE(wintypes.BOOL, wintypes.DWORD)
    def _handle(event: int) -> bool:
        if event in _CLOSED:
            interrupt_main()
            threading.main_thread().join(ENDING)
        return False  # the next handler's turn, at last that of Windows


def interrupt_at_close() -> None:
    """Raise KeyboardInterrupt in the main thread when the window is closed."""
    if sys.platform == "win32":
        ctypes.windll.kernel32.SetConsoleCtrlHandler(_handle, True)
