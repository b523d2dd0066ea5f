"""A person who looks at the page: `python -m tests.windows.looking LINK ROBOT`.

It ends well once a browser shows the robot, and that its run is live.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.dashboard.browser import page_at, started


def main(link: str, robot: str) -> None:
    """Look at the page behind the link. Raises AssertionError."""
    tree = f"document.querySelector('#tree').innerText.includes('{robot}')"
    lights = "document.querySelector('#lights').textContent"
    with (
        TemporaryDirectory() as folder,
        started(Path(folder)) as chromium,
        page_at(link, chromium, tree) as tab,
    ):
        tab.until(f"{lights}.includes('live')")


if __name__ == "__main__":
    main(*sys.argv[1:])
