"""A sweep on a cluster of Dask: `rems sweep --on dask=tcp://10.0.0.5:8786`."""

import importlib
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from typing import Any

from rems_net.errors import ExperimentError
from rems_net.libraries import needed

#: s. A scheduler that does not answer in this time is not there.
PATIENCE = 10


class DaskExecutor(AbstractContextManager[Executor]):
    """Connection to the scheduler of a cluster, whose executor a `with` yields."""

    def __init__(self, address: str):
        with needed("distributed", "dask"):
            distributed: Any = importlib.import_module("distributed")
        try:
            self._client = distributed.Client(address, timeout=PATIENCE)
        except (OSError, ValueError) as error:
            raise ExperimentError(
                f"there is no scheduler of Dask at {address!r} ({error}); expected such"
                " as --on dask=tcp://10.0.0.5:8786. (R1027)"
            ) from None

    def __enter__(self) -> Executor:
        # A run that is asked for again is computed again, not taken from a store.
        executor: Executor = self._client.get_executor(pure=False)
        return executor

    def __exit__(self, *_: object) -> None:
        self._client.close()
