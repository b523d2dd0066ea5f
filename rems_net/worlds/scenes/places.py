"""Places: whether robots can stand where they are to start."""

from collections.abc import Iterable, Sequence

from rems_net.errors import AgentError, SchemaError
from rems_net.worlds.scenes.outline import Outline, Pose, met, of_scene
from rems_net.worlds.scenes.scene import Scene


def check_places(
    keys: Sequence[str], bodies: Sequence[Outline], places: Sequence[Pose], scene: Scene
) -> None:
    """Raise SchemaError for a robot that starts where something else is.

    keys: of the robots, for the sentence      places: x and y in m, heading in rad
    """
    there = of_scene(scene)
    for key, body, place in zip(keys, bodies, places, strict=True):
        mine = body.at(place)
        if name := met(mine, there):
            x, y, _ = place
            raise SchemaError(
                f"{key} starts at x = {x:g} m, y = {y:g} m, where {name} is; one place "
                f"holds one of them: give {key} another `initial`, such as "
                f"{_free(body, there)}."
            )
        there.append((key, mine))


def check_free(
    key: str, body: Outline, place: Pose, others: Iterable[tuple[str, Outline]]
) -> None:
    """Raise AgentError for a robot that shall go back to where another is now."""
    if name := met(body.at(place), others):
        raise AgentError(
            key,
            f"{name} is where it starts: drive that away, or reset the whole world.",
        )


def _free(body: Outline, there: Sequence[tuple[str, Outline]]) -> str:
    """A place where it could stand, as a user writes it."""
    step = max(2 * body.reach, 0.01)
    for ring in range(1, 10):
        for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            place = (round(x * ring * step, 2), round(y * ring * step, 2), 0.0)
            if not met(body.at(place), there):
                return f"{{ x = {place[0]}, y = {place[1]} }}"
    return "{ x = 1.0, y = 1.0 }"
