"""Door: which requests are let in, and the files of the page.

A page of any site may open a connection to this machine. So a request must name this
server as its Host (else a name that was rebound to this machine would do), a WebSocket
must come from this server's own page (Origin), and its first message is the token of
the link. The token stands in the fragment of the link, which browsers never send.
"""

import hmac
import secrets
from collections.abc import Iterable
from functools import cache
from http import HTTPStatus
from pathlib import Path

FILES = Path(__file__).parent / "page"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
#: bits of a token; nobody guesses 128
BITS = 128
#: begin of the path at which viewers look
VIEWERS = "/viewer/"
Answer = tuple[HTTPStatus, dict[str, str], bytes]


class Door:
    """The port of a page: its token, and the names by which browsers reach it.

    hosts: names and addresses of this machine that may stand in a link
    """

    def __init__(self, hosts: Iterable[str], port: int):
        #: in the order in which links are shown
        self.hosts = [_bracketed(host) for host in hosts]
        self.port = port
        self.token = secrets.token_urlsafe(BITS // 8)
        #: token of viewers, which is another one; "" lets none in
        self.viewer = ""
        #: token -> user that has a page of their own
        self._users: dict[str, str] = {}

    def links(self, query: str = "") -> list[str]:
        """Return the links of the page, with its token; the last one reaches furthest.

        query: `?field=robot/sim/state/x` shows a plot of it.
        """
        apart = [h for h in self.hosts if h not in ("localhost", "[::1]")]
        return [f"http://{h}:{self.port}/{query}#{self.token}" for h in apart]

    def invite(self, users: Iterable[str]) -> dict[str, str]:
        """Let these users in; return the link of each, with a token of its own."""
        link, found = self.links()[-1].removesuffix(self.token), {}
        for user in users:
            token = secrets.token_urlsafe(BITS // 8)
            self._users[token] = user
            found[user] = link + token
        return found

    def viewers(self) -> list[str]:
        """Let viewers in; return their addresses.

        Lichtblick sends nothing but the address that its user typed, and the name of
        the protocol. So the token is a part of the path: programs keep a path less
        often than a query, but a viewer may remember it in its list of connections. It
        opens nothing but the viewers' protocol, and is another one at every start.
        """
        self.viewer = self.viewer or secrets.token_urlsafe(BITS // 8)
        apart = [h for h in self.hosts if h not in ("localhost", "[::1]")]
        return [f"ws://{h}:{self.port}{VIEWERS}{self.viewer}" for h in apart]

    def knows_viewer(self, path: str) -> bool:
        """Return whether it is the path of viewers, with their token."""
        given = path.removeprefix(VIEWERS) if path.isascii() else ""
        return hmac.compare_digest(given, self.viewer) and bool(self.viewer)

    def is_here(self, host: str | None) -> bool:
        """Return whether a Host names this server."""
        name, _, port = (host or "").rpartition(":")
        return name.lower() in self.hosts and port == str(self.port)

    def lets_in(self, host: str | None, origin: str | None) -> bool:
        """Return whether a WebSocket may open: its page is this server's own."""
        return self.is_here(host) and origin == f"http://{host}"

    def user_of(self, token: object) -> str | None:
        """Return the user whose token it is; "" for the page's own; None for none.

        The time that this takes does not depend on the token.
        """
        given = token if isinstance(token, str) and token.isascii() else ""
        found = None
        for one, user in (*self._users.items(), (self.token, "")):
            if hmac.compare_digest(given, one):
                found = user
        return found

    def answer(self, path: str, host: str | None) -> Answer:
        """Return status, headers and body for a request of a file."""
        if not self.is_here(host):
            return refusal(HTTPStatus.MISDIRECTED_REQUEST, "This is another server.")
        name = path.partition("?")[0].lstrip("/") or "index.html"
        body = files().get(name)
        if body is None:
            return refusal(HTTPStatus.NOT_FOUND, "There is no such file.")
        headers = {"Content-Type": TYPES[Path(name).suffix], **_guards(f"{host}")}
        return HTTPStatus.OK, headers, body


def _guards(host: str) -> dict[str, str]:
    """Return the headers by which a browser guards the page; host: of this server."""
    return {
        "Content-Security-Policy": (
            "default-src 'none'; script-src 'self'; style-src 'self'; "
            f"img-src 'self' data: blob:; connect-src 'self' ws://{host}; "
            "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        ),
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Cache-Control": "no-store",
    }


def refusal(status: HTTPStatus, sentence: str) -> Answer:
    """Return the answer to a request that is not let in."""
    headers = {"Content-Type": "text/plain; charset=utf-8", "Cache-Control": "no-store"}
    return status, headers, f"{sentence}\n".encode()


@cache
def files() -> dict[str, bytes]:
    """Return the files of the page by name; only these are ever served."""
    return {
        path.relative_to(FILES).as_posix(): path.read_bytes()
        for path in sorted(FILES.rglob("*"))
        if path.suffix in TYPES
    }


def _bracketed(host: str) -> str:
    host = host.lower()
    return f"[{host}]" if ":" in host and not host.startswith("[") else host
