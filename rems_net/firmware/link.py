"""Link: the functions of link.h over a real Zenoh session, which opens and closes.

Zenoh's threads queue what comes; the core receives it in `poll`, and nowhere else. A
failed request of the core returns False, never an exception: it tries again by itself.
"""

import threading
from collections.abc import Callable
from ctypes import CDLL, c_char_p, c_void_p, cast, string_at
from typing import Any

from rems_net.errors import FabricError
from rems_net.events import warn
from rems_net.firmware import library
from rems_net.firmware.library import Bytes
from rems_net.router.asking import Asking
from rems_net.router.finding.address import to_endpoint
from rems_net.router.finding.scouting import scout
from rems_net.router.gate.refusal import reach
from rems_net.router.mail import Mail, Mailbox, Question, encoding
from rems_net.router.publisher import Watch
from rems_net.router.session import Session
from rems_net.router.settings import Link as Settings

#: s to open a session in all; of that to search for a router; to reach it; and the
#: least that is left for Zenoh. LINK_STALL of link.h is 2.5 s.
OPENING, SCOUTING, REACHING, SHORTEST = 2.0, 0.7, 1.2, 0.4
#: Publishers that stay declared; a robot publishes about six keys.
MOST = 64
#: Largest number of messages in one poll, since the core has other work, too.
AT_ONCE = 256
#: Functions of link.h that return nothing.
QUIET = {name for name, kind in library.LINK.items() if kind._restype_ is None}


class ZenohLink:
    """Network of one robot's core. Only one thread calls it.

    core: the library.  bot: address of its `struct woodbot`.
    user, password: for a router that has users.
    """

    def __init__(self, core: CDLL, bot: int, user: str = "", password: str = ""):
        self._core, self._bot = core, bot
        self._user, self._password = user, password
        self._session: Session | None = None
        self._box = Mailbox()
        self._declared: dict[str, list[Watch]] = {}
        self._puts: dict[tuple[str, str, bool], Callable[..., None]] = {}
        self._asked: dict[Asking, int] = {}
        self._questions: dict[int, Question] = {}
        self._last = 0
        #: Number of sessions that were opened.
        self.opened = 0
        self._functions = [
            kind(_guarded(getattr(self, name))) for name, kind in library.LINK.items()
        ]
        self.struct = library.Link(None, *self._functions)

    # -- the network: that of this machine --------------------------

    def join(self, _: Any, settings: Any) -> None:
        """Do nothing: this computer is in its network already."""

    def network(self, _: Any) -> int:
        return library.NETWORK_UP

    def scan(self, _: Any, found: Any, room: int) -> int:
        return 0

    def open(self, _: Any, locator: bytes) -> bool:
        try:
            found = [to_endpoint(locator.decode())] if locator else scout(SCOUTING)
        except FabricError:
            return False
        if not found:
            return False
        # If no router listens, Zenoh would retry for all of the time, and other
        # addresses would have to wait.
        trip = reach(found[0], REACHING)
        if trip is None:
            return False
        left = OPENING - trip - (0.0 if locator else SCOUTING)
        user, password = self._user, self._password
        link = Settings(
            found[0], user=user, password=password, timeout=max(left, SHORTEST)
        )
        session = Session(link)
        if not session.open_once():
            return False
        self._session = session
        self.opened += 1
        return True

    def close(self, _: Any = None) -> None:
        session, self._session = self._session, None
        for question in [*self._questions.values()]:
            with question:  # ends the wait of the other side
                pass
        asked, self._asked = [*self._asked], {}
        declared = [watch for watches in self._declared.values() for watch in watches]
        self._box = Mailbox()  # drops messages that still come
        self._questions.clear()
        self._declared.clear()
        self._puts.clear()
        if session is None:
            return

        def end() -> None:
            for asking in asked:
                with asking:
                    pass
            for watch in declared:
                watch.close()
            session.close()

        # This takes 4 s if the router is frozen; a robot must not wait for that.
        threading.Thread(target=end, name="closing", daemon=True).start()

    def up(self, _: Any) -> bool:
        session = self._session
        return session is not None and session.connected

    def subscribe(self, _: Any, key: bytes) -> bool:
        return self._declare(key, lambda s, k: s.watch(k, self._box))

    def answer(self, _: Any, key: bytes) -> bool:
        return self._declare(key, lambda s, k: s.answer(k, self._box))

    def token(self, _: Any, key: bytes) -> bool:
        return self._declare(key, lambda s, k: s.present(k))

    def _declare(self, key: bytes, declare: Callable[[Session, str], Watch]) -> bool:
        session = self._session
        if session is None:
            return False
        name = key.decode()
        self._declared.setdefault(name, []).append(declare(session, name))
        return True

    def forget(self, _: Any, key: bytes) -> None:
        for watch in self._declared.pop(key.decode(), []):
            watch.close()

    def put(
        self,
        _: Any,
        key: bytes,
        payload: Bytes,
        encoded: bytes,
        attachment: Bytes,
        urgent: bool,
    ) -> bool:
        session = self._session
        if session is None:
            return False
        which = key.decode(), _schema(encoded), urgent
        put = self._puts.get(which)
        if put is None:
            if len(self._puts) >= MOST:
                self._puts.clear()
            put = self._puts[which] = session.putting(*which[:2], block=urgent)
        put(_taken(payload), attachment=_taken(attachment) or None)
        return True

    def ask(
        self, _: Any, selector: bytes, payload: Bytes, number: int, timeout: int
    ) -> bool:
        session = self._session
        if session is None:
            return False
        asking = session.asking(
            selector.decode(), _taken(payload), timeout / 1000, self._box.put
        )
        self._asked[asking] = number
        return True

    def reply(
        self,
        _: Any,
        question: int,
        key: bytes,
        payload: Bytes,
        encoded: bytes,
        attachment: Bytes,
    ) -> bool:
        asked = self._questions.get(question)
        if asked is None:
            return False
        stamp = _taken(attachment) or None
        asked.answer(key.decode(), _taken(payload), _schema(encoded), stamp)
        return True

    def refuse(self, _: Any, question: int, sentence: bytes) -> bool:
        asked = self._questions.get(question)
        if asked is None:
            return False
        asked.refuse(sentence.decode(errors="replace"))
        return True

    def poll(self, _: Any, ms: int) -> None:
        box, letter = self._box, self._box.get(ms / 1000)
        for _again in range(AT_ONCE):
            if letter is None:
                return
            self._tell(letter)
            if box is not self._box or box.empty():
                return
            letter = box.get(0)

    def _tell(self, letter: object) -> None:
        match letter:
            case Mail():
                self._heard(letter)
            case Question():
                self._ask_core(letter)
            case Asking():
                self._answered(letter)

    def _heard(self, mail: Mail) -> None:
        if mail.size > library.PAYLOAD:
            return  # as on the board: zenoh-pico drops it
        payload, attachment = mail.payload, mail.attachment
        key, encoded = mail.key.encode(), encoding(mail.schema).encode()
        told = key, _bytes(payload), encoded, _bytes(attachment)
        self._core.woodbot_heard(self._bot, *told)

    def _ask_core(self, question: Question) -> None:
        if question.size > library.PAYLOAD:
            with question:
                most = f"a Woodbot reads at most {library.PAYLOAD}"
                question.refuse(f"{question.size} bytes came; {most}")
            return
        self._last = number = self._last + 1
        self._questions[number] = question
        words = (f"{k}={v}" if v else k for k, v in question.parameters.items())
        key, payload = question.key.encode(), question.payload
        asked = ";".join(words).encode(), _bytes(payload)
        self._core.woodbot_asked(self._bot, number, key, *asked)
        if self._questions.pop(number, None) is not None:
            with question:
                pass

    def _answered(self, asking: Asking) -> None:
        number = self._asked.get(asking)
        if number is None:
            return
        for answer in asking.come():
            refused = isinstance(answer, str)
            if isinstance(answer, Mail):
                payload, attachment = answer.payload, answer.attachment
            else:
                payload, attachment = answer.encode(), b""
            if len(payload) <= library.PAYLOAD:
                told = _bytes(payload), _bytes(attachment)
                self._core.woodbot_answered(self._bot, number, refused, *told)
        if asking.ended:
            self._asked.pop(asking, None)


def _guarded(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function for C, which has no exceptions: an error returns 0."""

    def call(*given: Any) -> Any:
        try:
            return function(*given)
        except Exception as error:
            warn("link", f"the firmware's link: {function.__name__}: {error}")
            return None if function.__name__ in QUIET else 0

    return call


def _taken(given: Bytes) -> bytes:
    return string_at(given.at, given.size) if given.size else b""


def _bytes(given: bytes) -> Bytes:
    """Return `given` for C; valid only while a reference to `given` exists."""
    return Bytes(cast(c_char_p(given), c_void_p).value, len(given))


def _schema(encoded: bytes | None) -> str:
    return (encoded or b"").decode().partition(";")[2]
