"""Serving: the page of a fabric, from a free port until the caller ends it."""

import asyncio
import signal
import socket
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from rems_net.client import Fabric
from rems_net.dashboard.door import Door
from rems_net.dashboard.recorded.page import RecordedServer
from rems_net.dashboard.server import Server
from rems_net.errors import FabricError
from rems_net.router.find import open_session
from rems_net.router.finding.interfaces import reachable

#: addresses at which a socket listens on every network
EVERYWHERE = ("0.0.0.0", "::")
LOOPBACK = ("127.0.0.1", "localhost", "::1")


@contextmanager
def listening_at(
    host: str, ports: Iterable[int]
) -> Iterator[tuple[socket.socket, Door]]:
    """Yield a socket at the first free one of these ports, and its door.

    Raises FabricError if none is free, or if this machine does not have the address.
    """
    ports = list(ports)
    why = ""
    for port in ports:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            sock = socket.create_server((host, port), family=family, backlog=64)
        except (OSError, OverflowError) as error:
            why = getattr(error, "strerror", "") or str(error)
            continue
        with sock:
            hosts = [*LOOPBACK, *reachable()] if host in EVERYWHERE else [host]
            names = [*hosts, *LOOPBACK] if host in LOOPBACK else hosts
            yield sock, Door(dict.fromkeys(names), sock.getsockname()[1])
        return
    tried = f"port {ports[0]}" + (f" to {ports[-1]}" if len(ports) > 1 else "")
    raise FabricError(
        f"The page cannot listen at {host}, {tried}: {why}. Type another port, such as "
        "rems dashboard --port 8500 (R1002)"
    )


def serve(server: Server | RecordedServer, sock: socket.socket) -> None:
    """Serve pages at a bound socket until interrupted; then close what they show."""

    before = {}

    async def until_cancelled() -> None:
        # asyncio cancels at Ctrl+C. An exception of another signal's handler could be
        # raised in asyncio itself, between a task's end and the one that awaits it.
        loop, task = asyncio.get_running_loop(), asyncio.current_task()
        assert task is not None
        for name in ("SIGTERM", "SIGHUP"):  # Windows has no SIGHUP
            sign = getattr(signal, name, None)
            if sign and callable(signal.getsignal(sign)):
                before[sign] = signal.signal(
                    sign, lambda *_: loop.call_soon_threadsafe(task.cancel)
                )
        async with await server.listen(sock):
            await server.run()

    try:
        asyncio.run(until_cancelled())
    except asyncio.CancelledError:
        raise KeyboardInterrupt from None
    finally:
        for sign, handler in before.items():
            signal.signal(sign, handler)


def rejoin(name: str, at: str) -> Fabric:
    """Join as `join` does, for another run after the one that was shown."""
    return Fabric(open_session(name, at))
