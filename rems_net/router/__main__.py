"""`python -m rems_net.router`: a router for a class, until Ctrl+C."""

from __future__ import annotations

import argparse
import signal
import socket
import sys
import threading

from rems_net.errors import RemsError
from rems_net.router.find import PORT, VARIABLE
from rems_net.router.keeper import Keeper
from rems_net.router.session import Session
from rems_net.router.settings import Link


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m rems_net.router",
        description="A router for a class: laptops and robots join it as clients.",
        epilog=f"On every laptop: {VARIABLE}=tcp/<this machine>:{PORT} rems run ...",
    )
    parser.add_argument(
        "--listen",
        default=f"tcp/0.0.0.0:{PORT}",
        metavar="ENDPOINT",
        help="where to listen (default: %(default)s, every network of this machine)",
    )
    args = parser.parse_args()
    ended = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: ended.set())
    try:
        with Session(Link(args.listen, serve=True, lease=3.0)) as session:
            Keeper(session).keep()
            endpoint = args.listen.replace("0.0.0.0", socket.gethostname())
            print(f"Router at {args.listen}. {VARIABLE}={endpoint}", flush=True)
            while not ended.wait(0.5):  # a wait without end hides Ctrl+C on Windows
                pass
    except KeyboardInterrupt:
        return 0
    except RemsError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
