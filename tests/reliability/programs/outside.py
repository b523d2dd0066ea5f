"""A commander outside of any experiment: plain zenoh and msgpack, 20 times a second.

python -m tests.reliability.programs.outside ENDPOINT KEY     its first line is its pid
"""

from __future__ import annotations

import os
import sys
import time

import msgpack
import zenoh

from tests.reliability.programs.flood import client


def main() -> None:
    endpoint, key = sys.argv[1:]
    command = msgpack.packb({"speed": 0.5, "turn": 0.1})
    with zenoh.open(client(endpoint)) as session:
        print(os.getpid(), flush=True)
        while True:
            session.put(key, command)
            time.sleep(0.05)


if __name__ == "__main__":
    main()
