"""Frames: the channel /tf, with the pose of each robot, which viewers draw."""

from collections.abc import Mapping

from rems_net.defdict import Batch, Schema
from rems_net.recordings.mcap.derived import POSES, TF, Poses, has_pose
from rems_net.router.publisher import Watch

#: number of the channel; those of ports are greater
FRAMES = 1


class Frames:
    """The channel of all poses: of each robot whose state has x, y and heading."""

    id, agent, key = FRAMES, "", POSES
    watch: Watch | None = None

    def __init__(self) -> None:
        self.told = {
            "id": FRAMES,
            "topic": f"/{POSES}",
            "encoding": "cdr",
            "schemaName": TF[0],
            "schemaEncoding": "ros2msg",
            "schema": TF[1],
        }
        self._poses = Poses({})

    def meet(self, schemas: Mapping[str, Schema]) -> set[str]:
        """Take the schemas of all ports, by key; return the keys that have poses."""
        posed = {key: one for key, one in schemas.items() if has_pose(key, one)}
        self._poses = Poses(posed)
        return {*posed}

    def message(self, states: Mapping[str, bytes], t: int) -> bytes:
        """Return the poses of these states in CDR, by key. t: time [ns]."""
        return self._poses(Batch(states), t)
