"""One bench for all tests of a process: it is compiled once."""

import pytest

from tests.firmware.safety.bench import Bench


@pytest.fixture(scope="session")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Bench(tmp_path_factory.mktemp("motors") / "motors.so")
