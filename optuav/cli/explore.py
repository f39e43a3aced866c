"""``optuav explore``: a mission with sliders, in the browser."""

from __future__ import annotations

import os
import signal
import sys

from optuav.cli.options import mission_of
from optuav.cli.output import say


def explore(
    mission: str = "paper",
    settings: list[str] | None = None,
    port: int = 0,
    no_browser: bool = False,
) -> None:
    """Change a mission with sliders in the browser, and see its plan at once.

    Only this machine can open the page. Press Ctrl-C to stop.
    """
    base = mission_of(mission, settings)
    from optuav.explorer.server import Server

    if hasattr(signal, "SIGPIPE"):  # A browser that closes a connection does not end the command
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    with Server(base, port) as server:
        say(f"{server.address}\nCtrl-C stops it", most=None)
        sys.stdout.flush()
        # A browser in the terminal would take the terminal.
        if not no_browser and (
            sys.platform in ("win32", "darwin") or {"DISPLAY", "WAYLAND_DISPLAY"} & {*os.environ}
        ):
            import webbrowser

            webbrowser.open(server.address)
        server.serve_forever()
