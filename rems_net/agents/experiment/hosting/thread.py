"""Thread: a host in the process of its run, beside the clock."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from threading import Thread
from typing import Any

from rems_net.agents.diagnosis import describe, where
from rems_net.agents.host.host import Host
from rems_net.events import Event, listening, warn
from rems_net.router.session import Session

#: s. It may take so long to end once the clock waits no more; Python ends no thread.
LEAVING = 0.5


class HostThread:
    """The agents of the host `here`. It has the methods of a `HostProcess`.

    session: the clock's; they need no network between them.
    say: called with its name and each event of it.
    """

    pid = 0

    def __init__(self, name: str, session: Session, say: Callable[[str, Event], None]):
        self.name, self._say = name, say
        self._session = session
        self._thread: Thread | None = None
        #: an exit status, as of a process, once it has ended
        self.status: int | None = None
        #: the error that ended it, if the clock cannot know it
        self._error = ""

    def start(self, spec: Mapping[str, Any]) -> None:
        """Build its agents in a thread, and step them."""
        self._host = Host(self._session.beside(), self.name, spec["ticket"])
        thread = Thread(
            target=self._live, args=(spec,), name=f"host {self.name}", daemon=True
        )
        thread.start()
        self._thread = thread

    def _live(self, spec: Mapping[str, Any]) -> None:
        with listening(self._report, own=True):
            try:
                failed = self._host.run(spec)
            except Exception as error:  # the run has ended, and closed the session
                failed = self._error = describe(error)
        self.status = int(failed is not None)

    def _report(self, event: Event) -> None:
        agent, n = event.agent or self._host.acting, event.tick or self._host.n
        self._say(self.name, replace(event, agent=agent, tick=n))

    def death(self) -> str | None:
        """Return how it ended, if it has ended."""
        if self.status is None:
            return None
        return self._error or f"ended with status {self.status}"

    def leave(self) -> None:
        """Do nothing: it ends when the clock lets it go."""

    kill = leave

    def end(self) -> None:
        """Wait for its end; warn if a method of an agent does not return."""
        thread = self._thread
        if thread is None:  # Ctrl+C came before it was started
            return
        thread.join(LEAVING)
        if thread.is_alive():
            warn(
                "overdue",
                f"an agent still computes in this program ({where(thread)}), "
                "which only the end of the program ends",
                self.name,
            )
