"""One library for all tests of a process: it is compiled once."""

from collections.abc import Iterator

import pytest

from tests.firmware.emulated.scene import compiled
from tests.firmware.protocol.core import Core
from tests.firmware.protocol.world import World, world


@pytest.fixture(scope="session")
def core(tmp_path_factory: pytest.TempPathFactory) -> Core:
    return Core(tmp_path_factory.mktemp("protocol") / "protocol.so")


@pytest.fixture
def here() -> Iterator[World]:
    """A router; clocks and robots come as a test needs them."""
    compiled()
    with world() as made:
        yield made
