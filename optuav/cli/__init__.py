"""The command line: it reads options and prints answers, and computes nothing itself."""

import contextlib
import os
import signal
import sys
from _thread import allocate_lock, start_new_thread
from collections.abc import Sequence

SIGNALS: dict[int, str] = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
DEFAULTS = (signal.default_int_handler, signal.SIG_DFL)
BY_SIGNAL = 128  # Added to the number of a signal, makes the exit code
_leaving = allocate_lock()


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and leave with its exit code."""
    if arguments is None:
        _end_by_signals()
    from optuav.cli.app import run

    run(arguments)


def _end_by_signals() -> None:
    """Let Ctrl-C and SIGTERM end the process at once, also while it imports or a library works.

    Python handles a signal between two steps of the main thread, and some libraries swallow the
    exception. The first thread that is notified ends the process. Ignored signals stay ignored.
    """
    handled = [number for number in SIGNALS if signal.getsignal(number) in DEFAULTS]
    for number in handled:
        signal.signal(number, _leave)
    if handled and os.name == "posix":
        reading, writing = os.pipe()
        os.set_blocking(writing, False)
        signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
        start_new_thread(_wait, (reading,))


def _wait(reading: int) -> None:
    """Leave when a signal has come; each writes its number."""
    while (number := os.read(reading, 1)[0]) not in SIGNALS:
        pass
    _leave(number)


def _leave(number: int, *_: object) -> None:
    """End the process with its children, and leave no half-written file and no hidden cursor."""
    if not _leaving.acquire(blocking=False):
        return
    # The process ends whatever fails here, even where modules are half imported.
    with contextlib.suppress(Exception):
        files = sys.modules.get("optuav.mission.files")
        for path in tuple(getattr(files, "unfinished", ())):
            path.unlink(missing_ok=True)
        if processes := sys.modules.get("multiprocessing"):
            if studies := sys.modules.get("optuav.studies.processes"):
                # A process that has half begun would print that its parent is gone.
                studies.starting.acquire(timeout=0.5)
            for child in processes.active_children():
                child.kill()
            # Else the process that keeps track of semaphores prints a warning of its own.
            if clearing := sys.modules.get("multiprocessing.util"):
                clearing._run_finalizers(0)
        if sys.stderr.isatty():
            os.write(2, b"\x1b[?25h")
    with contextlib.suppress(OSError):
        os.write(2, f"\n{SIGNALS[number]}\n".encode())
    os._exit(BY_SIGNAL + number)
