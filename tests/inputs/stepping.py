"""Steps of an engine, until an input has moved something."""

from collections.abc import Callable

from rems_net.agents.experiment.solo import Solo
from tests.agents.runs import until


def moves(engine: Solo, done: Callable[[], object]) -> None:
    """Step until something is so."""

    def look() -> bool:
        engine.step(1)
        return bool(done())

    until(look)
