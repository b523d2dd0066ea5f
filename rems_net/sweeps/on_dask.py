"""A sweep on a cluster of Dask: `rems sweep --on dask=tcp://10.0.0.5:8786`."""

import importlib
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import closing, contextmanager
from typing import Any

from rems_net.errors import ExperimentError
from rems_net.libraries import needed

#: s. A scheduler that does not answer in this time is not there.
PATIENCE = 10


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """Yield the executor of a cluster, by its scheduler. Raises ExperimentError."""
    with needed("distributed", "dask"):
        distributed: Any = importlib.import_module("distributed")
    try:
        client = distributed.Client(address, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        raise ExperimentError(
            f"there is no scheduler of Dask at {address!r} ({error}); expected such"
            " as --on dask=tcp://10.0.0.5:8786. (R1027)"
        ) from None
    with closing(client):
        # A run that is asked for again is computed again, not taken from a store.
        yield client.get_executor(pure=False)
