"""A debugger: at a word, it stops all threads of a process, and holds them.

`python -m tests.reliability.programs.debugger PID` prints `ready`; at a line on its
standard input it stops the process, and prints when (CLOCK_MONOTONIC, s). The process
goes on when this one ends.
"""

import ctypes
import os
import sys
import time
from pathlib import Path

SEIZE, INTERRUPT = 0x4206, 0x4207


def main() -> None:
    pid = int(sys.argv[1])
    library = ctypes.CDLL(None, use_errno=True)
    library.ptrace.argtypes = [ctypes.c_long] * 4
    threads = [int(one.name) for one in Path(f"/proc/{pid}/task").iterdir()]

    def each(request: int) -> None:
        for thread in threads:
            if library.ptrace(request, thread, 0, 0) < 0:
                raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))

    each(SEIZE)
    print("ready", flush=True)
    sys.stdin.readline()
    print(time.monotonic(), flush=True)
    each(INTERRUPT)
    sys.stdin.read()


if __name__ == "__main__":
    main()
