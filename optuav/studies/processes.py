"""Independent tasks by several processes, with the results of doing one after the other."""

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from threading import Lock, Thread
from typing import Any, TypeVar

from optuav.fields import Range
from optuav.plugins import read_plugins

Result = TypeVar("Result")
FEWEST = 4  # Tasks that are worth a process, which takes a second to start
starting = Lock()  # Held while processes begin
WORKERS = Range("-", ge=1, le=1000, whole=True)


def run_tasks(
    function: Callable[..., Result], tasks: Sequence[tuple[Any, ...]], workers: int
) -> Iterator[Result]:
    """Yield the value of a module-level function for the arguments of each task, in order.

    The calls are made in this process, or by several that import the function on their own.
    """
    if (most := min(workers, len(tasks) // FEWEST)) < 2:
        yield from (function(*task) for task in tasks)
        return
    with ProcessPoolExecutor(most, get_context("spawn"), _begin) as pool:
        with interrupts_blocked():
            results = pool.map(function, *zip(*tasks, strict=True))
        yield from results


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """While processes begin, which inherit it from this thread: they do not handle interrupts."""
    blocked = {signal.SIGINT} if hasattr(signal, "pthread_sigmask") else set()
    if blocked:
        signal.pthread_sigmask(signal.SIG_BLOCK, blocked)
    try:
        with starting:
            yield
    finally:
        if blocked:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, blocked)


def _begin() -> None:
    """Begin a process that shares tasks."""
    stay_with_parent()
    read_plugins()


def stay_with_parent() -> None:
    """Leave interrupts to the process that asked, and end when it ends, however it does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
