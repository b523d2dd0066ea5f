"""A shared router behind its gate, and the lines on its screen."""

import sys
from collections.abc import Iterator

import pytest

from rems_net.router.gate.users import Users
from rems_net.router.session import Session
from rems_net.router.settings import Link
from rems_net.router.stop_store import class_router
from tests.agents.runs import free_port
from tests.router.relay.raw import Raw

PASSWORDS = {
    "teacher": "seven green herons",
    "anna": "a cold teapot",
    "ben": "two wet socks",
}
USERS = Users({"members": ["teacher"], "guests": ["anna", "ben"]}, PASSWORDS)
#: only Linux has all of 127.0.0.x
many_addresses = pytest.mark.skipif(
    sys.platform != "linux", reason="this system has one loopback address"
)


class Shared:
    """A shared router in this process."""

    def __init__(self, users: Users | None):
        self.port = free_port()
        self.endpoint = f"tcp/127.0.0.1:{self.port}"
        self.users = users
        self.lines: list[str] = []

    @property
    def screen(self) -> str:
        return "\n".join(self.lines)

    def session(self, user: str = "", host: str = "") -> Session:
        bound = f"#bind={host}:0" if host else ""
        password = PASSWORDS.get(user, "")
        return Session(Link(self.endpoint + bound, user=user, password=password))

    def raw(self, zid: bytes = b"", host: str = "127.0.0.1") -> Raw:
        return Raw(self.port, zid, host)


def shared(users: Users | None) -> Iterator[Shared]:
    found = Shared(users)
    with class_router(found.endpoint, users, report=found.lines.append):
        yield found


@pytest.fixture
def router() -> Iterator[Shared]:
    """Open to everybody."""
    yield from shared(None)


@pytest.fixture
def closed() -> Iterator[Shared]:
    """With users."""
    yield from shared(USERS)
