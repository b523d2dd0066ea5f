"""The files of the page: small, typed, reachable by keys, and open to everybody."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from rems_net.dashboard.door import FILES, TYPES, files
from tests.commands import fetched
from tests.dashboard.browser import Chromium
from tests.dashboard.test_page import Lab

CHECKED = {
    "allowJs": True,
    "checkJs": True,
    "noEmit": True,
    "strict": True,
    "target": "ES2022",
    "module": "ES2022",
    "moduleResolution": "bundler",
    "lib": ["ES2022", "DOM", "DOM.Iterable"],
}


def test_it_is_small_and_its_own() -> None:
    texts = {name: body.decode() for name, body in files().items()}
    assert {Path(name).suffix for name in texts} <= TYPES.keys()
    assert sum(map(len, texts.values())) < 200_000
    assert sum(text.count("\n") for text in texts.values()) <= 3030
    for name, text in texts.items():
        assert "innerHTML" not in text, name
        assert "eval(" not in text, name
        found = [w for w in text.split() if "http" in w and "w3.org" not in w]
        assert not found, f"{name} names another site: {found}"


@pytest.mark.slow
def test_its_types_are_checked(tmp_path: Path) -> None:
    compiler = fetched(tmp_path, "typescript") / ".bin" / "tsc"
    told = {"compilerOptions": CHECKED, "include": [f"{FILES.as_posix()}/*.js"]}
    (tmp_path / "tsconfig.json").write_text(json.dumps(told), encoding="utf-8")
    done = subprocess.run(
        [str(compiler), "-p", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == ""


@pytest.mark.slow
def test_everybody_can_use_it(tmp_path: Path, chromium: Chromium) -> None:
    """By axe-core: no serious finding, at every size, in light and dark."""
    axe = fetched(tmp_path / "npm", "axe-core") / "axe-core" / "axe.min.js"
    lab = Lab(tmp_path)
    try:
        with chromium.apart() as tab:
            tab.go(lab.link)
            tab.until("rems.store.ports.size > 2")
            tab.run(f"{axe.read_text(encoding='utf-8')}; 1")
            for width, height in ((360, 740), (1280, 800), (2560, 1440)):
                for dark in (False, True):
                    tab.size(width, height, dark=dark)
                    found = tab.run(
                        "axe.run().then(r => r.violations.filter("
                        "v => ['serious', 'critical'].includes(v.impact))"
                        ".map(v => [v.id, v.nodes.map(n => String(n.target))]))"
                    )
                    assert found == []
            assert tab.errors == []
    finally:
        lab.close()
