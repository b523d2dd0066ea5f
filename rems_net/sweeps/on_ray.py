"""A sweep on a cluster of Ray: `rems sweep --on ray=10.0.0.5:6379`."""

import importlib
import os
import socket
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

from rems_net.errors import ExperimentError
from rems_net.libraries import needed
from rems_net.maths.numerics import environment

#: s. A head that does not answer in this time is not there.
PATIENCE = 10.0


class RayExecutor(Executor):
    """Executor of a cluster of Ray. Its processes are pinned as hosts are."""

    def __init__(self, address: str):
        with needed("ray", "ray"):
            ray: Any = importlib.import_module("ray")
        outer = dict(os.environ)
        made = environment(outer)
        pins = {name: made[name] for name in made if outer.get(name) != made[name]}
        self._ours = not ray.is_initialized()
        try:
            if self._ours:
                _look_for(address)
                ray.init(address, logging_level="error", log_to_driver=False)
        except (OSError, ValueError, RuntimeError) as error:
            raise ExperimentError(
                f"there is no cluster of Ray at {address!r} ({error}); expected such "
                "as --on ray=10.0.0.5:6379, or --on ray=auto on one of its machines."
                " (R1027)"
            ) from None
        self._ray = ray
        self._call = ray.remote(_call).options(runtime_env={"env_vars": pins})

    def submit(
        self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any
    ) -> Future[Any]:
        """Call a function with these arguments on a free core of the cluster."""
        outer: Future[Any] = Future()
        outer.set_running_or_notify_cancel()

        def pass_on(inner: Future[Any]) -> None:
            error = inner.exception()
            if error is None:
                outer.set_result(inner.result())
            else:  # of an error in the function Ray makes a longer one
                cause = getattr(error, "cause", None)
                outer.set_exception(cause if isinstance(cause, Exception) else error)

        self._call.remote(fn, args, kwargs).future().add_done_callback(pass_on)
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster, if this executor has joined it."""
        if self._ours:
            self._ray.shutdown()


def _look_for(address: str) -> None:
    """Raise OSError or ValueError if nothing listens: Ray itself waits for minutes."""
    host, colon, port = address.rpartition(":")
    if colon and "://" not in address:
        with socket.create_connection((host, int(port)), PATIENCE):
            pass


def _call(fn: Callable[..., Any], args: Any, kwargs: Any) -> Any:
    return fn(*args, **kwargs)
