"""`rems why`: each trouble is made, and answered with what to do."""

import re
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from rems_net.client.checkup import Finding
from rems_net.client.doctor import examine
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import Router, free_port, until
from tests.cli.conftest import FREE
from tests.commands import Run, Start
from tests.signals import freeze, thaw


def bad(endpoint: str) -> list[str]:
    """What is not well there."""
    return [one.sentence for one in examine(endpoint) if not one.well]


def good(endpoint: str) -> list[str]:
    return [one.sentence for one in examine(endpoint) if one.well]


@contextmanager
def program(says: bytes | None) -> Iterator[str]:
    """A program that says something to whoever connects; None: it hangs up."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            while True:
                try:
                    line, _ = server.accept()
                except OSError:
                    return
                with line, suppress(OSError):  # who has heard it may hang up
                    if says is not None:
                        line.sendall(says)
                        while line.recv(1000):
                            pass

        threading.Thread(target=serve, daemon=True).start()
        yield f"tcp/127.0.0.1:{server.getsockname()[1]}"
        with suppress(OSError):  # Windows does not need it, and refuses it
            server.shutdown(socket.SHUT_RDWR)


def test_alone(program: Run) -> None:
    done = program("why")
    assert (done.returncode, done.stderr) == (0, "")
    first, second = done.stdout.splitlines()
    assert re.fullmatch(r"ok   Python \S+, rems_net \S+, zenoh \S+ on \w+", first)
    assert second == (
        "ok   nothing runs on this laptop, and no router was joined. `rems run` and "
        "`rems demo` bring one; for a class: rems router use ADDRESS"
    )


def test_no_router(rems: Run) -> None:
    port = free_port()
    done = rems("router", "status", f"127.0.0.1:{port}")
    assert done.returncode == 1
    assert done.stdout.splitlines()[1] == (
        f"BAD  127.0.0.1 is there, and nothing listens at port {port}: start `rems "
        "router serve` or `python -m rems_net.router` on it, or mind the port. If it "
        "runs there, a firewall refuses what comes: allow Python on it"
    )


@pytest.mark.parametrize("name", ["no-such-laptop.invalid", "lab..pc"])
def test_a_name_that_nobody_knows(name: str) -> None:
    assert bad(f"tcp/{name}:7447")[0] == (
        f"nobody knows the name {name!r} on this network: type the router's address, "
        "as `rems router serve` prints it"
    )


def test_a_web_server() -> None:
    with HTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            endpoint = f"tcp/127.0.0.1:{server.server_port}"
            (sentence,) = bad(endpoint)
        finally:
            server.shutdown()
            thread.join()
    assert sentence == (
        f"{endpoint} is a web server, and no router: mind the port (7447); or this "
        "network wants you to sign in first: open a web page. (R0605)"
    )


def test_another_program() -> None:
    with program(b"SSH-2.0-OpenSSH_9.6\x1b[2J\r\n") as endpoint:
        (sentence,) = bad(endpoint)
    assert sentence == (
        f"{endpoint} is another program, and no router: it answers "
        "'SSH-2.0-OpenSSH_9.6?[2J'. (R0605)"
    )


def test_a_program_that_says_nothing() -> None:
    """As a proxy does, or a VPN that takes every connection; and one that hangs up."""
    for says in (b"", None):
        with program(says) as endpoint:
            assert bad(endpoint) == [
                f"{endpoint} takes connections and answers nothing: a VPN or a proxy "
                "in between takes them in the router's place (turn it off), the router "
                "is frozen or has more connections than it takes, or it is another "
                "program: mind the port (7447). Where `rems router serve` runs, s and "
                "Enter stop all robots. (R0605)"
            ]


def test_a_router_that_is_frozen() -> None:
    with Router() as router:
        freeze(router.pid)
        try:
            (sentence,) = bad(router.endpoint)
        finally:
            thaw(router.pid)
    assert "the router is frozen" in sentence


def test_a_router_that_lets_nobody_in(tmp_path: Path) -> None:
    users = tmp_path / "users.toml"
    users.write_text('[members]\nanna = "seven green herons"\n')
    users.chmod(0o600)
    with Router("--users", str(users)) as router:
        (sentence,) = bad(router.endpoint)
    assert "set REMS_USER and REMS_PASSWORD to yours" in sentence


def test_a_router_without_a_clock_and_with_two() -> None:
    with Router() as router:
        assert "no fabric has a clock there yet (`rems router serve`)" in good(
            router.endpoint
        )
        with Session(Link(router.endpoint)) as session:
            session.present("rems/robot/lonely/@alive")
            assert bad(router.endpoint)[0] == (
                "fabric 'rems' has robots and no clock: they stand still until `rems "
                "router serve` or `rems run` starts one"
            )
            session.present("rems/clock/@run/1")
            session.present("rems/clock/@run/2")
            assert bad(router.endpoint)[0] == (
                "fabric 'rems' has 2 clocks, so agents receive two times: end one of "
                "them, or give it a --fabric of its own"
            )


def test_all_is_well_and_a_clock_freezes(
    rems: Run, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        clock = start("router", "serve")
        until(lambda: "has one clock" in "".join(good(router.endpoint)))

        def fine() -> list[str]:  # a busy machine's answers may be slow ones
            done = rems("why")
            return [] if done.returncode else done.stdout.splitlines()

        assert "ok   fabric 'rems' has one clock" in until(fine)
        freeze(clock.pid)
        try:
            sentence = "the clock of 'rems' does not answer: it is frozen, or cut off"
            assert Finding(False, sentence) in list(examine(router.endpoint))
        finally:
            thaw(clock.pid)


def test_a_run_on_this_laptop(rems: Run, start: Start, folder: Path) -> None:
    (folder / "free.toml").write_text(FREE)
    start("run", "free.toml")
    until(lambda: "has one clock" in rems("why").stdout)
