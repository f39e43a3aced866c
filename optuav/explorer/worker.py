"""Answers from processes of their own, which are ended where they take too long."""

import time
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from queue import LifoQueue
from typing import Any

from optuav.explorer.answers import answers
from optuav.mission import Mission
from optuav.plugins import read_plugins
from optuav.presentation.numbers import figure
from optuav.studies.processes import interrupts_blocked, stay_with_parent

LONGEST_S = 20.0
MOST_AT_ONCE = 2
LOOK_S = 0.1  # Pause between looks whether the answer is still wanted


class Worker:
    """A process that answers about a mission, one question after the other."""

    def __init__(self, mission: Mission, longest_s: float = LONGEST_S) -> None:
        self._mission, self._longest_s = mission, longest_s
        self._start()

    def ask(self, state: Any, wanted: Callable[[], bool] = lambda: True) -> dict[str, Any]:
        """The answer to a state; after the longest time, or if the process ends, a fault.

        A `ConnectionAbortedError` is raised if nobody waits for the answer any more.
        """
        latest_s = time.monotonic() + self._longest_s
        try:
            self._pipe.send(state)
            while (left_s := latest_s - time.monotonic()) > 0.0 and wanted():
                if self._pipe.poll(min(left_s, LOOK_S)):
                    found: dict[str, Any] = self._pipe.recv()
                    return found
            words = f"no answer within {figure(self._longest_s)} s"
        except (EOFError, OSError):
            left_s, words = 0.0, "optuav failed: the terminal says why"
        self.end()
        self._start()
        if left_s > 0.0:
            raise ConnectionAbortedError
        number = state.get("number") if isinstance(state, dict) else None
        return {"number": number, "faults": [{"key": "", "words": words}]}

    def end(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        self._process.join()
        self._pipe.close()

    def _start(self) -> None:
        context = get_context("spawn")
        self._pipe, theirs = context.Pipe()
        arguments = (self._mission, theirs)
        self._process = context.Process(target=_answer, args=arguments, daemon=True)
        with interrupts_blocked():
            self._process.start()
        theirs.close()


class Workers:
    """Workers that answer side by side; all but the first start when they are needed."""

    def __init__(self, mission: Mission) -> None:
        self._mission, self._started = mission, [Worker(mission)]
        self._idle: LifoQueue[Worker | None] = LifoQueue()
        for worker in (*[None] * (MOST_AT_ONCE - 1), *self._started):
            self._idle.put(worker)

    def ask(self, state: Any, wanted: Callable[[], bool] = lambda: True) -> dict[str, Any]:
        """Like `Worker.ask`, by a worker that has nothing to do."""
        worker = self._idle.get()
        try:
            if not wanted():
                raise ConnectionAbortedError
            if worker is None:
                worker = Worker(self._mission)
                self._started.append(worker)
            return worker.ask(state, wanted)
        finally:
            self._idle.put(worker)

    def end(self) -> None:
        """End all processes, whatever they do."""
        for worker in self._started:
            worker.end()


def _answer(mission: Mission, pipe: Connection) -> None:
    """Answer what comes through a pipe until it is closed."""
    stay_with_parent()
    read_plugins()
    while True:
        try:
            state = pipe.recv()
        except EOFError:
            return
        pipe.send(answers(mission, state))
