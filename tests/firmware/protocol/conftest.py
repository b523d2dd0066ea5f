"""One library for all tests of a process: it is compiled once."""

from __future__ import annotations

import pytest

from tests.firmware.protocol.core import Core


@pytest.fixture(scope="session")
def core(tmp_path_factory: pytest.TempPathFactory) -> Core:
    return Core(tmp_path_factory.mktemp("protocol") / "protocol.so")
