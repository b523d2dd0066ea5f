"""A Woodbot by the shared library, started and steered as the posix port is.

It takes those of its options that the tests use, and no lines of control.
"""

import argparse
import sys

from rems_net.firmware.robot import EmulatedRobot, log_into, running


def main() -> None:
    parser = argparse.ArgumentParser()
    for option in ("--name", "--router", "--servos"):
        parser.add_argument(option, required=True)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--control", choices=("-",), required=True)
    told = parser.parse_args()
    settings = {"name": told.name, "router": told.router}
    settings |= dict(one.split("=", 1) for one in told.set)
    robot = EmulatedRobot(settings, pulsed=log_into(told.servos))
    with running([robot]):
        for line in sys.stdin:
            print(f"error: no such line: {line.strip()}", flush=True)


if __name__ == "__main__":
    main()
