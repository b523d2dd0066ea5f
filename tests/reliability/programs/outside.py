"""A commander outside of any experiment: plain zenoh and msgpack, 20 times a second.

python -m tests.reliability.programs.outside ENDPOINT KEY COMMAND

The command is JSON. Its first line is its pid.
"""

import json
import os
import sys
import time

import msgpack
import zenoh

from tests.reliability.programs.flood import client


def main() -> None:
    endpoint, key, said = sys.argv[1:]
    command = msgpack.packb(json.loads(said))
    with zenoh.open(client(endpoint)) as session:
        print(os.getpid(), flush=True)
        while True:
            session.put(key, command)
            time.sleep(0.05)


if __name__ == "__main__":
    main()
