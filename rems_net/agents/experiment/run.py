"""One run of an experiment: its router, its clock and its host processes."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.folder import Result, note_end
from rems_net.agents.experiment.hosting.hosts import END, Hosts
from rems_net.agents.experiment.placement.offers import Giving, Offers
from rems_net.agents.experiment.show import Reports
from rems_net.agents.protocol.terms import Terms
from rems_net.errors import AgentError, ExperimentError, FabricError
from rems_net.events import Event, listening, warn
from rems_net.router import find
from rems_net.router.gate.identity import check_member, team_of
from rems_net.router.keys import FABRIC
from rems_net.router.session import Session
from rems_net.router.settings import Link


class Run:
    """One run of an experiment: its router, its clock, and its hosts' processes.

    Hosts in the terms that `hosts` does not start join from other machines.
    out: the folder of the outputs' files.  offers: the agents that machines bring.
    clock: makes the ticks, once it goes on.  result: known when it is over.
    beside: the run's name. With it, the run uses a fabric of its own if that of its
    team has a clock already; "" for never.
    """

    clock: Clock
    result: Result

    def __init__(
        self,
        fabric: str,
        terms: Terms,
        hosts: Hosts,
        out: Path,
        offers: Offers,
        *,
        beside: str = "",
    ):
        self.fabric, self.terms, self.hosts = fabric, terms, hosts
        self.out, self._offers, self._beside = out, offers, beside
        self._ending = False

    @contextmanager
    def going(self) -> Iterator[None]:
        """Start the hosts, and end them after the block, which makes the ticks.

        Raises AgentError, after ending everything.
        """
        with listening(self._report):
            terms, show = self.terms, self.hosts.show
            if Path("rems_net.py").exists():
                raise ExperimentError(
                    "rems_net.py, in this folder, hides rems_net from its own "
                    "processes. Rename it, for example to my_rems_net.py. (R0431)"
                )
            session, note = self._session()
            self.hosts.reports = Reports(session)
            try:
                clock = self.clock = Clock(
                    session,
                    terms,
                    look=self._look,
                    lives=self.hosts.lives,
                    start=self.hosts.start_again,
                )
                clock.open()
                show.begin(clock, terms.ticks, session.link.endpoint)
                try:
                    with self._members(clock, session.link):
                        yield
                except BaseException as error:
                    note_end(error, clock.done, clock.dt, self.out)
                    raise
                finally:
                    show.end()
            finally:
                if note is not None:
                    note.unlink(missing_ok=True)
                self.hosts.reports = None
                session.close()

    @contextmanager
    def _members(self, clock: Clock, link: Link) -> Iterator[None]:
        """Start the hosts; end them after the block, also after an error."""
        giving = Giving(clock.session, self._offers)
        # Existing objects stay: the collector skips them, so that no tick waits. What
        # the program around this run has frozen stays frozen.
        ours = not gc.get_freeze_count()
        try:
            self.hosts.start(link, clock=clock.session)
            clock.gather()
            giving.close()
            if ours:
                gc.freeze()
            yield
        except BaseException:
            self._release(clock, patience=0.3)
            raise
        finally:
            if ours:
                gc.unfreeze()
        failure = self._release(clock, patience=END)
        if failure is not None:
            raise failure
        made = [Path(p) for p in clock.made()]
        self.result = Result(clock.tick.n, self.out, made)

    def _release(self, clock: Clock, patience: float) -> AgentError | None:
        self._ending = True
        try:
            return clock.release(END)
        finally:
            self.hosts.end(patience)

    def _session(self) -> tuple[Session, Path | None]:
        fabric = self.fabric
        if find.chosen():
            session = find.open_session(fabric, own=True)
            try:
                check_member(session)
            except FabricError:
                session.close()
                raise
            return self._free(session), None
        if self.terms.machines:
            text = (
                "this run brings a router of its own, which only this laptop can "
                "reach; for others, first: rems router use ADDRESS"
            )
            warn("router", text, "clock")
        return find.serve(fabric or FABRIC)

    def _free(self, session: Session) -> Session:
        """Return a session on the team's fabric, or beside it if it has a run."""
        if not (self._beside and team_of(session)):
            return session
        if not session.who(session.key("clock", "@alive")):
            return session
        own = f"{session.fabric}-{self._beside}"
        text = f"{session.fabric!r} has a clock already: this run is on {own!r}"
        self.hosts.show.say("clock", Event("info", 0, "clock", "fabric", text))
        return session.on(own)

    def _report(self, event: Event) -> None:
        tick = self.clock.tick.n if hasattr(self, "clock") else 0
        event = replace(event, agent=event.agent or "clock", tick=event.tick or tick)
        self.hosts.say("clock", event)

    def _look(self) -> None:
        if not self._ending:
            self.hosts.look()
