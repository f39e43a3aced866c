"""Calls by workers of a Dask cluster have the results of one process, whatever becomes of them."""

from __future__ import annotations

import asyncio
import gc
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

import optuav
from optuav.errors import Fault, InputError, SolverError
from optuav.studies import cluster
from tests.studies.test_sweep import content, study

STUDY = """
scenarios_per_part = {each}
[samples]
count = {count}
battery.capacity_As = {{ percent = 10 }}
"""


@contextmanager
def process(*words: str) -> Iterator[subprocess.Popen[str]]:
    """A process of Python that ends with the block."""
    command = [sys.executable, "-m", *words]
    with subprocess.Popen(command, text=True, stderr=subprocess.PIPE) as started:
        try:
            yield started
        finally:
            started.kill()


@contextmanager
def scheduler() -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A scheduler as a process of its own, and its address."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    where = ("--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    with process("distributed.cli.dask_scheduler", *where) as started:
        yield f"tcp://127.0.0.1:{port}", started


def worker(address: str) -> tuple[str, ...]:
    """The words for a worker that nothing starts again."""
    return "distributed.cli.dask_worker", address, "--no-nanny", "--nthreads", "1", "--no-dashboard"


def parts(directory: Path, least: int) -> None:
    """Wait until so many parts are there."""
    late = time.monotonic() + 120.0
    while len([*directory.glob("part-*")]) < least:
        assert time.monotonic() < late
        time.sleep(0.01)


@pytest.mark.slow
def test_two_processes_call_what_one_calls() -> None:
    """Each number once, with memory as one process has it; errors are raised as they are.

    Another cluster may have the address that Dask prefers for its pages.
    """
    with suppress(OSError), socket.create_server(("", 8787)), cluster.local_cluster(1):
        pass
    seen = dict(cluster.results(lambda n: (n, os.getpid(), dict(os.environ)), range(80), 2, None))
    assert {number: found[0] for number, found in seen.items()} == {n: n for n in range(80)}
    assert len({process for _, process, _ in seen.values()} - {os.getpid()}) == 2
    assert all("MALLOC_TRIM_THRESHOLD_" not in environ for *_, environ in seen.values())

    def refused(number: int) -> int:
        raise InputError([Fault("key", str(number), "another")])

    with pytest.raises(InputError, match="key = 7: another"):
        list(cluster.results(refused, [7], 2, None))


def test_one_process_needs_no_cluster(monkeypatch: pytest.MonkeyPatch) -> None:
    """In order; and nothing is started where nothing is left to do."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert [*cluster.results(lambda n: n * n, [3, 1], 1, None)] == [(3, 9), (1, 1)]
    assert [*cluster.results(lambda n: n * n, [], 2, "tcp://127.0.0.1:1")] == []
    with pytest.raises(InputError, match="need distributed"):
        list(cluster.results(lambda n: n * n, [3], 2, None))


@pytest.mark.parametrize(
    "address", ["nonsense", "foo://127.0.0.1:1", "tcp://127.0.0.1:{free}", "inproc://x", ""]
)
def test_no_scheduler_is_one_error_in_time(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "PATIENCE_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = address.format(free=free.getsockname()[1])
    began_s = time.monotonic()
    with pytest.raises(InputError, match=r"scheduler = '.*': must be the address of a Dask"):
        list(cluster.results(lambda n: n, [1], 1, address))
    assert time.monotonic() - began_s < 10.0


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(
    "address", ["{http}", "{worker}", "tls://{http}", "ws://{http}", "ucx://{http}"]
)
def test_what_is_no_scheduler_is_one_error_in_time(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A server that says nothing until it is asked for a page, a worker, and other protocols."""
    from distributed.core import Server

    class Worker(Server):
        """What answers as a worker does."""

    monkeypatch.setattr(cluster, "PATIENCE_S", 0.5)

    async def refused() -> None:
        async with Worker({}) as worker:
            await worker.listen("tcp://127.0.0.1:0")
            page = HTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler)
            where = address.format(http=f"127.0.0.1:{page.server_port}", worker=worker.address)
            with (
                page,
                pytest.raises(InputError, match="the address of a Dask scheduler, such as tcp"),
            ):
                await asyncio.to_thread(cluster.results, lambda n: n, [1], 1, where)

    asyncio.run(asyncio.wait_for(refused(), 10.0))
    gc.collect()  # Of the connection that distributed leaves where nothing answers


def test_without_a_scheduler_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The study may be changed, and swept to the same directory."""
    monkeypatch.setattr(cluster, "PATIENCE_S", 0.5)
    file = study(tmp_path, STUDY.format(each=9, count=9))
    with pytest.raises(InputError, match="the address of a Dask scheduler"):
        optuav.sweep(file, scheduler="tcp://127.0.0.1:1")
    with pytest.raises(InputError, match="workers = 3: cannot be combined with a scheduler"):
        optuav.sweep(file, workers=3, scheduler="tcp://127.0.0.1:1")
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match="need distributed"):
        optuav.sweep(file, workers=2)
    assert [*tmp_path.iterdir()] == [file]


@pytest.mark.soak
def test_a_call_that_kills_its_workers_and_one_that_fails_are_named() -> None:
    with pytest.raises(SolverError, match="part 3 killed every worker that computed it"):
        list(cluster.results(lambda n: os._exit(1) if n == 3 else n, [3], 2, None))
    with pytest.raises(SolverError, match="a worker failed: ZeroDivisionError"):
        list(cluster.results(lambda n: 1 // n, [0], 2, None))


@pytest.mark.soak
def test_a_worker_that_is_killed_loses_nothing(tmp_path: Path) -> None:
    """Two of three with parts in hand; the third, and one that comes late, end with the same bytes.

    More parts wait than any number of workers is given at once.
    """
    text = STUDY.format(each=500, count=100_000)
    expected = content(optuav.sweep(study(tmp_path, text, "whole")).directory)
    file, directory = study(tmp_path, text, "shared"), tmp_path / "shared"
    with (
        scheduler() as (address, _),
        process(*worker(address)) as first,
        process(*worker(address)) as second,
        process(*worker(address)) as third,
        process("optuav", "sweep", str(file), "--scheduler", address) as asking,
    ):
        parts(directory, 3)
        first.kill()
        second.kill()
        parts(directory, len([*directory.glob("part-*")]) + 10)
        third.kill()
        with process(*worker(address)):
            assert asking.wait(120) == 0
    assert content(directory) == expected


@pytest.mark.soak
def test_a_scheduler_that_dies_is_one_error_and_the_parts_stay(tmp_path: Path) -> None:
    """The command ends within seconds, and goes on without it."""
    text = STUDY.format(each=2000, count=80_000)
    expected = content(optuav.sweep(study(tmp_path, text, "whole")).directory)
    file, directory = study(tmp_path, text, "shared"), tmp_path / "shared"
    with (
        scheduler() as (address, started),
        process(*worker(address)),
        process("optuav", "sweep", str(file), "--scheduler", address) as asking,
    ):
        parts(directory, 3)
        started.kill()
        said = asking.communicate(timeout=40)[1]
    assert asking.returncode == 3
    assert said == "error: the scheduler is gone, or has cancelled the work\n"
    there = content(directory)
    assert there.items() <= expected.items()
    assert optuav.sweep(file).kept == len(there) - 1
    assert content(directory) == expected
