"""RecordedRuns: one recording, or two of one experiment, as a page shows them."""

from collections.abc import Set
from itertools import chain
from pathlib import Path
from typing import Any

from rems_net.dashboard.feed import Channel
from rems_net.dashboard.protocol import Value
from rems_net.dashboard.recorded.run import RecordedRun, Track
from rems_net.dashboard.recorded.scenes import scenes_of
from rems_net.errors import ExperimentError
from rems_net.packing import pack
from rems_net.recordings.mcap.writer import FILE
from rems_net.recordings.parting.together import mark

#: the channel of ticks, as a clock publishes them
CLOCK = Channel(0, "clock/tick", "")
#: s. A tick of a recording that does not name its own.
TICK = 0.01
#: ns. Times in a file are rounded to less than this.
SLACK = 500


class RecordedRuns:
    """One or two recordings, for their pages. `close` it at the end.

    paths: of the recording, and perhaps of a second one, whose robots are the ghosts
    of the first one's. Raises ExperimentError, in one sentence, for a file that is no
    recording, and for a second one of another experiment.
    """

    def __init__(self, *paths: Path) -> None:
        self.runs: list[RecordedRun] = []
        try:
            for path in paths:
                first = sum(len(run.tracks) for run in self.runs) + 1
                word = mark(_names(paths[0]), _names(path)) if self.runs else ""
                self.runs.append(RecordedRun(path, first, word))
                _check(self.runs)
        except ExperimentError:
            self.close()
            raise
        told = self.runs[0].file.told
        self.name = told.experiment or paths[0].stem
        #: s. Length of a tick, and the first and the last value.
        self.dt = told.dt or TICK
        self.begin = min(run.begin for run in self.runs)
        self.end = max(run.end for run in self.runs)
        self.scenes = scenes_of(told)
        for ghosts in self.runs[1:]:
            for agent, scene in scenes_of(ghosts.file.told).items():
                if agent.startswith("robot/"):
                    self.scenes[ghosts.named(agent)] = scene | {"ghost": agent}

    def close(self) -> None:
        """Close the files."""
        for run in self.runs:
            run.close()

    @property
    def tracks(self) -> list[tuple[RecordedRun, Track]]:
        """The recorded ports of all recordings."""
        return [(run, track) for run in self.runs for track in run.tracks]

    @property
    def agents(self) -> list[str]:
        """The keys of all agents, as the page names them."""
        return list(dict.fromkeys(track.agent for _, track in self.tracks))

    @property
    def notes(self) -> list[str]:
        """Sentences on recordings that are not whole."""
        return [
            f"{_shown(run.file.path)} has no end: its writer was killed, or the file "
            f"is cut off. It is shown up to {run.end:g} s."
            for run in self.runs
            if not run.file.whole
        ]

    def described(self) -> dict[str, Any]:
        """Return what a page receives first: schemas, channels, scenes and agents."""
        schemas = chain.from_iterable(run.schemas().items() for run in self.runs)
        channels = [CLOCK, *(track.channel for _, track in self.tracks)]
        return {
            "schemas": dict(schemas),
            "channels": [one._asdict() for one in channels],
            "scenes": self.scenes,
            "status": {"agents": [[a, a.partition("/")[0], ""] for a in self.agents]},
        }

    def recording(self) -> dict[str, Any]:
        """Return what the page needs to play it."""
        paths = [run.file.path for run in self.runs]
        return {
            "name": " and ".join(map(_shown, paths)),
            "begin": self.begin,
            "end": self.end,
            "dt": self.dt,
            "notes": self.notes,
        }

    def number(self, t: float) -> int:
        """Return the tick at a time [s], or the last one before it."""
        return int(t / self.dt + 1e-6)

    def until(self, n: int) -> int:
        """Return a time [ns] between the values of tick n and those of the next."""
        return round(n * self.dt * 1e9) + SLACK

    def shown(self, looks: Set[str]) -> list[tuple[RecordedRun, Track]]:
        """Return the ports that a page shows, as a live page receives them.

        These are the states of robots, worlds, and the agents and ports in `looks`.
        """
        return [
            (run, track)
            for run, track in self.tracks
            if not looks.isdisjoint((track.agent, track.channel.key))
            or track.agent.startswith("world/")
            or (track.agent.startswith("robot/") and track.port == "state")
        ]

    def tick(self, n: int, pace: float) -> tuple[int, Value]:
        """Return the value of the clock at tick n, with the number of its channel."""
        t = n * self.dt
        return CLOCK.id, (pack([n, t]), pack([1, n, t, 0, pace, 0, 0]))


def _names(path: Path) -> tuple[str, str]:
    """Return the names of a recording: that of its file, and that of its folder."""
    return path.stem, path.resolve().parent.name


def _shown(path: Path) -> str:
    """Return the name of a recording: that of its folder, if a run has named it."""
    path = path.resolve()
    return path.parent.name if path.name == FILE else path.name


def _check(runs: list[RecordedRun]) -> None:
    """Raise ExperimentError if the newest one cannot be shown, or not with the first.

    Ghosts are compared with robots of the same name in the same experiment.
    """
    first, newest = runs[0], runs[-1]
    path = newest.file.path
    if not any(newest.file.counts.values()):
        passed = ", ".join(newest.file.passed)
        also = f" (passed over: {passed})" if passed else ""
        raise ExperimentError(
            f"{path} has no values that the page can show{also}; expected the run.mcap "
            "of a run. (R1005)"
        )
    if newest is first:
        return
    names = [run.file.told.experiment for run in (first, newest)]
    robots = [
        {key.rpartition("/")[0] for key in run.file.channels if key[:6] == "robot/"}
        for run in (first, newest)
    ]
    if names[0] != names[1] or not robots[0] & robots[1]:
        raise ExperimentError(
            f"{path} is a recording of {names[1] or 'no experiment'!r} with "
            f"{', '.join(sorted(robots[1])[:4]) or 'no robot'}, and the first one of "
            f"{names[0] or 'no experiment'!r} with "
            f"{', '.join(sorted(robots[0])[:4]) or 'no robot'}; ghosts are robots of "
            "the same names in the same experiment, so give two such recordings. "
            "(R1005)"
        )
