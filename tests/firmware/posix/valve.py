"""Valve: a way between a robot and its router that can be shut, without any rights.

open       bytes pass
held       nothing passes; new connections are taken, and get no answer
swallowed  the same, and new connections are not even taken (Linux)
When it is opened again, what was held passes, late; or, where the other side has
forgotten the connection, it is broken.
"""

import socket
import threading
from contextlib import suppress

CHUNK = 65536
FILLERS = 8


class Valve:
    """One thread takes connections, and two carry each."""

    def __init__(self, target: str):
        host, _, port = target.removeprefix("tcp/").rpartition(":")
        self._target = (host, int(port))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self._listener.getsockname()[1]}"
        self._gate = threading.Event()
        self._gate.set()
        self._taking = threading.Event()
        self._taking.set()
        self._open: list[socket.socket] = []
        self._fillers: list[socket.socket] = []
        self._closed = False
        threading.Thread(target=self._take, daemon=True).start()

    def shut(self, *, swallow: bool = False) -> None:
        """Let nothing pass from here on."""
        self._gate.clear()
        if not swallow:
            return
        self._taking.clear()
        with suppress(OSError):  # wakes who takes connections
            socket.create_connection(self._listener.getsockname(), 1.0).close()
        self._listener.listen(0)
        for _ in range(FILLERS):  # a full queue drops who knocks
            one = socket.socket()
            one.setblocking(False)
            with suppress(BlockingIOError):
                one.connect(self._listener.getsockname())
            self._fillers.append(one)

    def open(self, *, forgotten: bool = False) -> None:
        """Let it pass again; `forgotten`: connections of before are broken."""
        if forgotten:
            self._break()
        for one in self._fillers:
            one.close()
        self._fillers.clear()
        self._listener.listen(100)
        self._gate.set()
        self._taking.set()

    def close(self) -> None:
        self._closed = True
        self.open(forgotten=True)
        self._listener.close()

    def _break(self) -> None:
        for one in self._open:
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
        self._open.clear()

    def _take(self) -> None:
        while not self._closed:
            self._taking.wait()
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            threading.Thread(target=self._connect, args=(near,), daemon=True).start()

    def _connect(self, near: socket.socket) -> None:
        self._open.append(near)
        self._gate.wait()
        try:
            far = socket.create_connection(self._target, 5.0)
        except OSError:
            near.close()
            return
        far.settimeout(None)
        self._open.append(far)
        for one in (near, far):
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        back = threading.Thread(target=self._carry, args=(far, near), daemon=True)
        back.start()
        self._carry(near, far)
        back.join()
        near.close()
        far.close()

    def _carry(self, source: socket.socket, target: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(CHUNK):
                self._gate.wait()
                target.sendall(data)
        for one in (source, target):
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
