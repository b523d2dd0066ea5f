"""A Webots that is the stand-in, in this process."""

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rems_net.drivers.webots import connection
from rems_net.drivers.webots.installation import HOME, URL
from tests.drivers.webots.models import spec

STANDIN = Path(__file__).parent / "standin"
World = Callable[..., None]


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> Iterator[World]:
    """Open a world: `world(WOODBOT, step=3)`; a world at a time."""

    def opened(model: dict[str, Any], **more: Any) -> None:
        monkeypatch.setenv("REMS_STANDIN", json.dumps(spec(model, **more)))
        forget()

    def forget() -> None:
        """Be a new process, as far as Webots is concerned."""
        sys.modules.pop("controller", None)
        for name, value in (("_supervisor", None), ("_where", ""), ("_user", "")):
            monkeypatch.setattr(connection, name, value)
        monkeypatch.setenv(URL, "")

    monkeypatch.setenv(HOME, str(STANDIN))
    monkeypatch.setenv("PYTHONIOENCODING", "UTF-8")
    monkeypatch.setattr(sys, "path", [*sys.path])
    yield opened
    forget()
