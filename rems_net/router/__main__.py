"""`python -m rems_net.router`: a router for a class, until Ctrl+C."""

import argparse
import signal
import sys
import threading
from pathlib import Path

from rems_net.errors import RemsError
from rems_net.router.find import VARIABLE
from rems_net.router.finding.address import PORT, host_and_port, is_here, to_endpoint
from rems_net.router.gate.users import load
from rems_net.router.message import machine
from rems_net.router.stop_store import class_router

EXAMPLES = f"""\
On every laptop: {VARIABLE}=tcp/<this machine>:{PORT} rems run ...

examples:
  python -m rems_net.router
  python -m rems_net.router --listen tcp/127.0.0.1:{PORT}   this machine only
  python -m rems_net.router --users users.toml

users.toml, which only you can read (chmod 600):
  [members]        # run experiments
  anna = "seven green herons"
  [guests]         # read, command robots, stop them
  team1 = "a cold teapot"
Each sets REMS_USER and REMS_PASSWORD.
"""


def main() -> int:
    """Run a router; return the exit status, 2 for a mistake in the command."""
    args = _parser().parse_args()
    ended = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: ended.set())
    try:
        users = load(args.users) if args.users else None
        listen = to_endpoint(args.listen)
        with class_router(listen, users):
            endpoint = listen.replace("0.0.0.0", machine())
            said = [f"Router at {listen}. {VARIABLE}={endpoint}"]
            if users is not None:
                said.append(f"{args.users}: {users.count}; nobody else is let in.")
            elif not is_here(listen):
                _, port = host_and_port(listen)
                said.append(
                    "All who reach it can stop and end runs; limit it by "
                    f"--listen tcp/127.0.0.1:{port} or --users FILE"
                )
            print("\n".join(said), flush=True)
            while not ended.wait(0.5):  # an endless wait blocks Ctrl+C on Windows
                pass
    except KeyboardInterrupt:
        return 0
    except RemsError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m rems_net.router",
        description="A router for a class: laptops and robots join it as clients.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--listen",
        default=f"tcp/0.0.0.0:{PORT}",
        metavar="ENDPOINT",
        help="where to listen (default: %(default)s, every network of this machine)",
    )
    parser.add_argument(
        "--users",
        type=Path,
        metavar="FILE",
        help="names and passwords: nobody else is let in, and guests run nothing",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
