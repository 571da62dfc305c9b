"""Work on a Dask cluster: results in the order of arrival, workers that come and go, and every failure in one line.

joblib's own Dask backend waits for ever for a task that the scheduler has given up, so tasks go to the scheduler here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from typing import Any

from vrsopt.errors import InputError

CONNECTING = 5.0  # s until a scheduler must have answered
WORKERS = 60.0  # s until it must have a worker: batch systems take their time


def connect(address: str) -> Any:
    """A client of the scheduler at ``address``, which has a worker: a context manager that closes the connection.

    Raises :class:`InputError` without Dask, and without a scheduler that answers or has workers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputError(f"dask = {address}: Dask is not installed: pip install vrsopt[dask]") from None
    try:
        client = Client(address, timeout=CONNECTING, set_as_default=False)
    except (OSError, ValueError, TypeError):
        raise InputError(f"dask = {address}: no scheduler answers: an address as tcp://host:8786") from None
    try:
        client.wait_for_workers(1, timeout=WORKERS)
    except TimeoutError:
        client.close()
        raise InputError(f"dask = {address}: the scheduler has no workers") from None
    return client


def results(client: Any, function: Callable[..., Any], tasks: Iterator[tuple[Any, ...]]) -> Iterator[list[Any]]:
    """``function(*task)`` of every task, computed by the workers of ``client``'s cluster: lists of what has arrived.

    Two tasks per thread of the cluster are under way at any time; those of a worker that is lost are done by another.
    Raises :class:`InputError` when the workers can not do the work (no package there), when a task took several workers
    with it, and when the scheduler is lost.
    """
    from distributed import KilledWorker, as_completed

    address = client.scheduler.address
    futures = as_completed(loop=client.loop)  # a set that is emptied in the order of arrival
    while True:
        for task in tasks:
            futures.add(client.submit(function, *task, pure=False))
            if futures.count() >= 2 * sum(client.ncores().values()):
                break
        if futures.is_empty():
            return
        try:
            arrived = [future.result() for future in futures.next_batch()]
        except KilledWorker:
            raise InputError(f"dask = {address}: a task ended every worker that tried it: see their logs") from None
        except CancelledError:
            raise InputError(f"dask = {address}: the connection to the scheduler was lost") from None
        except ImportError as error:
            raise InputError(f"dask = {address}: its workers lack a package: {error}") from None
        yield arrived
