"""Calls of a function by this process, or by the workers of a Dask cluster."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import ExitStack
from itertools import islice
from operator import call
from typing import Any, TypeVar

from optuav.errors import Fault, InputError, OptuavError, SolverError, require, shown
from optuav.registration import with_registered

Result = TypeVar("Result")
Function = Callable[[int], Result]
PATIENCE_S = 10  # For a scheduler to answer
AHEAD = 32  # Calls that wait for a worker, beside two for each thread


def results(
    function: Function[Result], numbers: Sequence[int], workers: int, scheduler: str | None
) -> Generator[tuple[int, Result]]:
    """Yield each number with the value of a function, in the order of completion.

    The calls are made here, by so many processes of this machine, or by the workers of a scheduler,
    which may come and go: another worker finishes the work of a lost one. A scheduler that cannot
    be reached is refused before the first is asked for.
    """
    if not numbers or (workers == 1 and scheduler is None):
        return ((number, function(number)) for number in numbers)
    require("distributed", "several workers and schedulers")
    if scheduler is not None:
        try:
            with ThreadPoolExecutor(1) as pool:  # A notebook has a loop of its own
                pool.submit(asyncio.run, _reach(scheduler)).result()
        except Exception as error:  # Each kind of address has errors of its own
            words = "the address of a Dask scheduler, such as tcp://10.0.0.1:8786"
            if not isinstance(error, ValueError):  # Its words are Python's
                words += f"; {str(error) or f'no answer within {PATIENCE_S} s'}"
            raise InputError([Fault("scheduler", shown(scheduler), words)]) from None
    return _shared(function, numbers, min(workers, len(numbers)), scheduler)


def _shared(
    function: Function[Result], numbers: Sequence[int], workers: int, scheduler: str | None
) -> Generator[tuple[int, Result]]:
    """The calls by a cluster, which ends with them if it is of this machine."""
    from distributed import Client
    from distributed.utils import silence_logging_cmgr

    with ExitStack() as stack:
        stack.enter_context(silence_logging_cmgr(logging.CRITICAL))  # What fails is raised
        where = stack.enter_context(local_cluster(workers)) if scheduler is None else scheduler
        client = stack.enter_context(Client(where, set_as_default=False))
        yield from _called(client, function, numbers)


def local_cluster(workers: int) -> Any:
    """Processes of this machine with a scheduler."""
    import dask
    from distributed import LocalCluster

    # With the first, memory of arrays goes back to the system after each step, and is asked for
    # again; the others are for monitors.
    costly = {
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
        "distributed.worker.profile.enabled": False,
        "distributed.admin.tick.interval": "1s",
    }
    with dask.config.set(costly):
        return LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",  # No address would be one that another may have
            silence_logs=logging.CRITICAL,
        )


async def _reach(scheduler: str) -> None:
    """Raise an error where no scheduler answers: a client would try again, or wait for ever."""
    from distributed.core import connect, send_recv
    from distributed.security import Security

    async def kind() -> str:
        options = Security().get_connection_args("client")
        there = await connect(scheduler, timeout=PATIENCE_S, **options)
        try:
            return str((await send_recv(there, op="identity"))["type"])
        finally:
            there.abort()

    if (found := await asyncio.wait_for(kind(), PATIENCE_S)) != "Scheduler":
        raise ConnectionError(f"a {found} of Dask answers there")


def _called(
    client: Any, function: Function[Result], numbers: Sequence[int]
) -> Generator[tuple[int, Result]]:
    """The calls by a cluster, some more being submitted as others end."""
    from distributed import KilledWorker, as_completed

    left, number_of = iter(numbers), dict[str, int]()
    ended = as_completed(loop=client.loop)
    try:
        equipped = with_registered(function)  # A script may have registered things of its own
        shared = client.submit(lambda: equipped, pure=False)  # Sent to each worker once
        while True:
            most = AHEAD + 2 * sum(client.nthreads().values())  # Fewer where workers have left
            for number in islice(left, max(0, most - len(number_of))):
                future = client.submit(call, shared, number, pure=False)
                number_of[future.key] = number
                ended.add(future)
            if not number_of:
                return
            future = next(ended)
            number = number_of.pop(future.key)
            yield number, future.result()
    except OptuavError:
        raise
    except KilledWorker:
        words = "killed every worker that computed it, perhaps because it needs too much memory"
        raise SolverError(f"part {number} {words}") from None
    except (CancelledError, OSError) as error:
        raise SolverError("the scheduler is gone, or has cancelled the work") from error
    except Exception as error:
        raise SolverError(f"a worker failed: {type(error).__name__}: {error}") from error
