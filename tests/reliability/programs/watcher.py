"""A watcher of everything: a plain zenoh program that subscribes to `**`, and counts.

python -m tests.reliability.programs.watcher ENDPOINT     says `watching`, then counts
"""

import sys
import time

import zenoh

from tests.reliability.programs.flood import client


def main() -> None:
    count = 0

    def hear(sample: zenoh.Sample) -> None:
        nonlocal count
        count += 1

    with zenoh.open(client(sys.argv[1])) as session:
        watch = session.declare_subscriber("**", hear)
        said = 0
        while True:
            time.sleep(0.05)
            if count > said == 0:
                print("watching", flush=True)
            said = count
            assert watch is not None


if __name__ == "__main__":
    main()
