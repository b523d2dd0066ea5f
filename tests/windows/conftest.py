"""Windows' Python under Wine, with rems_net installed by the README's first command."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.windows.wine import Windows, missing


@pytest.fixture(scope="session")
def windows() -> Iterator[Windows]:
    """The system, with rems_net in its Python; it is made where it is not there yet.

    It takes some minutes, 2 GB, and package registries; the folder is kept.
    """
    if why := missing():
        pytest.skip(f"There is no Wine here with what its Python needs; {why}.")
    usual = Path.home() / ".cache" / "rems_net-wine"
    made = Windows(Path(os.environ.get("REMS_WINE", usual)))
    made.make()
    made.install()
    yield made
    made.end()
