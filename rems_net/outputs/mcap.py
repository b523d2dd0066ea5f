"""McapOutput: everything that a run publishes, in one file that other programs open."""

import json
from collections.abc import Mapping
from pathlib import Path

from rems_net.agents.agent import Output
from rems_net.agents.ports import In, Messages, Settings
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.defdict import Batch, Schema, boolean
from rems_net.errors import AgentError
from rems_net.outputs.events import Events
from rems_net.outputs.refused import failed, taken
from rems_net.pictures import is_picture
from rems_net.recordings.manifest import read_manifest
from rems_net.recordings.mcap.derived import Derived, Rays, derived
from rems_net.recordings.mcap.log import EVENTS, LOG, log
from rems_net.recordings.mcap.scan import scan
from rems_net.recordings.mcap.writer import FILE, McapWriter

#: what of run.json is in the file, too: it depends on the experiment alone
ABOUT = (
    *("experiment", "dt", "ticks", "seed", "agents", "robots", "worlds"),
    *("sources", "versions", "fields"),
)


class McapOutput(Output):
    """Writes `run.mcap`: every value of every port, with its schema, at its time.

    The file is in chunks of a second of fabric time, or of 1 MiB (4 KiB for each
    channel, if that is more). A run that is killed leaves whole chunks, and started
    again after a crash it goes on behind them.
    """

    options = Settings(
        pictures=boolean(default=True, doc="whether it has ports with pictures")
    )
    inputs = In(source="input/*/*", messages=True)
    processes = In(source="process/*/*", messages=True)
    robots = In(source="robot/*/*", messages=True)
    worlds = In(source="world/*/*", messages=True)

    def open(self) -> None:
        """Have no file yet: it begins with the first tick."""
        self._file: McapWriter | None = None
        self._ports = 0
        self._derived: list[Derived] = []
        self._events = Events()
        #: ports that are left out
        self._out: set[str] = set()

    def write(self, tick: Tick) -> None:
        """Add the values of this tick."""
        read: list[Messages] = [self.__dict__[port] for port in self.ins()]
        try:
            file = self._file or self._begin()
            ports = sum(len(some.schemas) for some in read)
            if self._ports != ports:
                schemas = {k: one for some in read for k, one in some.schemas.items()}
                if not self.options.pictures:
                    rows = ((k, f) for k, s in schemas.items() for _, f in s.rows())
                    self._out = {key for key, field in rows if is_picture(field)}
                    schemas = {k: schemas[k] for k in schemas.keys() - self._out}
                self._ports, self._derived = ports, derived(schemas, self._rays())
                file.declare(schemas, self._derived)
            events = [*self._events.of(self, read)]
            messages = Batch()
            for some in read:
                messages.add(some)
                some.clear()
            for key in self._out & messages.keys():
                del messages[key]
            time = round(tick.t * 1e9)
            for one in self._derived:
                if made := one.message(messages, time):
                    messages[one.key] = made
            file.add(tick.n, time, messages)
            if events and EVENTS not in file.channels:
                file.declare({}, [Derived(EVENTS, LOG)])
            for event in events:
                file.add(tick.n, time, {EVENTS: log(time, *event)})
            file.end_tick()
        except OSError as error:
            raise failed(self.key, self.out / FILE, error) from None
        except ValueError as error:
            text = f"cannot write {self.out / FILE}: {error} (R0801)"
            raise AgentError(self.key, text) from None

    def _begin(self) -> McapWriter:
        path = self.out / FILE
        if path.is_file() and self.restarts:
            self._file = scan(path)
            self._file.resume()
        else:
            self._file = McapWriter(path)
            try:
                self._file.open(self._about())
            except FileExistsError:
                raise taken(self.key, path) from None
        return self._file

    def _about(self) -> dict[str, str]:
        """Return what the file has of its experiment, as JSON."""
        told = read_manifest(self.out)
        plain = {} if told is None else told.plain()
        if told is not None and told.dt != runtime(self).dt:
            plain["dt"] = runtime(self).dt  # of the open fabric that it has joined
        return {name: json.dumps(plain[name]) for name in ABOUT if name in plain}

    def _rays(self) -> Rays:
        """Return the rays of robots, by name, as the run has described them."""
        told = read_manifest(self.out)
        return {} if told is None else {n: r.rays for n, r in told.robots.items()}

    def close(self) -> None:
        """Write the last chunk, and the summary."""
        if self._file is not None:
            try:
                self._file.close()
            except OSError as error:
                raise failed(self.key, self.out / FILE, error) from None

    def expected(self, ports: Mapping[str, Schema]) -> list[str]:
        """Return the file."""
        return [FILE]

    def made(self) -> list[Path]:
        """Return the file."""
        return [] if self._file is None else [self._file.path]
