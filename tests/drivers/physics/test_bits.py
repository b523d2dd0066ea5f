"""Physics does to the last bit what it did: an engine is told what it was told."""

import pytest

from tests.drivers.physics.golden import ENGINES, computed_by, file, rows
from tests.drivers.physics.test_physics import needs


@pytest.mark.parametrize(
    "engine", [pytest.param(name, marks=needs(name)) for name in ENGINES]
)
def test_a_woodbot_goes_where_it_went_to_the_last_bit(engine: str) -> None:
    golden = file(engine).read_text(encoding="utf-8").splitlines()
    if golden[0] != computed_by(engine):
        pytest.skip(
            f"{file(engine).name} was computed by {golden[0][2:]}; here is "
            f"{computed_by(engine)[2:]}, which rounds as it likes"
        )
    assert rows(engine) == golden, "if it may: python -m tests.drivers.physics.golden"
