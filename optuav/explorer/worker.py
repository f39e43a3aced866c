"""Answers from a process of its own, which is ended where it takes too long."""

from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Lock
from typing import Any

from optuav.explorer.answers import answers
from optuav.mission import Mission
from optuav.studies.processes import interrupts_blocked, stay_with_parent

LONGEST_S = 20.0


class Worker:
    """A process that answers about a mission, one question after the other."""

    def __init__(self, mission: Mission, longest_s: float = LONGEST_S) -> None:
        self._mission, self._longest_s, self._one_at_a_time = mission, longest_s, Lock()
        self._start()

    def ask(self, state: Any) -> dict[str, Any]:
        """The answer to a state; after the longest time, or if the process ends, a fault."""
        with self._one_at_a_time:
            try:
                self._pipe.send(state)
                if self._pipe.poll(self._longest_s):
                    found: dict[str, Any] = self._pipe.recv()
                    return found
                words = f"there is no answer within {self._longest_s:g} s"
            except (EOFError, OSError):
                words = "optuav failed: the terminal says why"
            self.end()
            self._start()
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


def _answer(mission: Mission, pipe: Connection) -> None:
    """Answer what comes through a pipe until it is closed."""
    stay_with_parent()
    while True:
        try:
            state = pipe.recv()
        except EOFError:
            return
        pipe.send(answers(mission, state))
