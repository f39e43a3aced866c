"""Tasks shared by processes: the results of doing them in turn, and errors as they are."""

from __future__ import annotations

from pathlib import Path

import pytest

import optuav
from optuav.errors import InputError
from optuav.studies import processes


def test_results_come_in_the_order_of_the_tasks_whoever_does_them() -> None:
    """Two processes return what one does; what one of them raises is raised here."""
    tasks = [(7, 2), (9, 4), (20, 6)] * 3
    for workers in (1, 2):
        assert [*processes.run_tasks(divmod, tasks, workers)] == [(3, 1), (2, 1), (3, 2)] * 3
    with pytest.raises(ZeroDivisionError):
        list(processes.run_tasks(divmod, [*tasks, (1, 0)], 2))


@pytest.mark.parametrize("workers", [0, -1, 1001, 2.0, True, "2", None])
def test_a_number_of_processes_is_a_whole_number(workers: object, tmp_path: Path) -> None:
    """Refused before anything is computed or written, with the range."""
    with pytest.raises(
        InputError, match=r"workers( = .*)?: must be a whole number, 1 <= x <= 1000"
    ):
        optuav.reproduce(tmp_path / "out", workers=workers)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="workers"):
        optuav.compare("paper", workers=workers)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_processes_where_they_do_not_share_the_work_are_refused_with_their_number() -> None:
    with pytest.raises(InputError, match="workers = 2: goes with by = 'method' only"):
        optuav.compare("paper", by="schedule", workers=2)


@pytest.mark.soak
def test_two_processes_make_the_files_and_tables_of_one(tmp_path: Path) -> None:
    """The whole report byte by byte, and the comparison of all engines."""
    for workers in (1, 2):
        optuav.reproduce(tmp_path / str(workers), workers=workers)
    alone, shared = (
        {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*.*")}
        for folder in (tmp_path / "1", tmp_path / "2")
    )
    assert alone == shared
    assert len(alone) > 100
    tables = [optuav.compare("paper", slots_s=(60.0,), workers=each).rows for each in (1, 2)]
    assert tables[0] == tables[1]
