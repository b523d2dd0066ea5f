"""Tells a running fabric what each line says, and when: pause, resume, stop, release.

For each line of the standard input it prints CLOCK_MONOTONIC from before it tells, and
then does it; `ask` prints what it was told, too. Its argument is the fabric's name.
"""

import sys
import time

import rems_net


def main() -> int:
    with rems_net.join("".join(sys.argv[1:])) as fabric:
        print("ready", flush=True)
        for line in sys.stdin:
            word = line.strip()
            print(repr(time.monotonic()), flush=True)
            if word == "stop":
                fabric.stop()
            elif word == "release":
                fabric.release()
            else:
                fabric.clock(word)
            print("done", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
