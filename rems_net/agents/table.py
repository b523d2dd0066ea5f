"""Table: options of an agent that are a line of TOML, such as `track = "100 mm"`."""

import re
from typing import Any

from rems_net.errors import ExperimentError
from rems_net.toml import TOMLDecodeError, loads

#: A path of several names, which TOML takes only in quotes.
_PATH = re.compile(r"(?<![\w\"'/])([\w.-]+(?:/[\w.-]+)+)(?=\s*=)")


def table(given: str, name: str) -> dict[str, Any]:
    """Return the values of an option. Raises ExperimentError."""
    quoted = _PATH.sub(r'"\1"', given)
    try:
        return dict(loads(f"all = {{ {quoted} }}")["all"])
    except TOMLDecodeError as error:
        raise ExperimentError(
            f"{name} = {given!r:.80} cannot be read ({error}); write such as "
            "'x = \"10 mm\", heading = 0.1'. (R0881)"
        ) from None
