"""The explorer in a browser: a server for this machine alone, and for who knows its address."""

import json
import os
import secrets
import sys
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, NamedTuple

from optuav.errors import Fault, InputError
from optuav.explorer.answers import refuse_many
from optuav.explorer.static import script, text
from optuav.explorer.worker import Worker
from optuav.mission import Mission
from optuav.mission.files import parse_json

HERE = "127.0.0.1"
LARGEST_BYTES = 64_000  # Of a request
SILENCE_S = 30.0  # After which a connection is closed
HTML, CODE, STYLE = (f"text/{kind}; charset=utf-8" for kind in ("html", "javascript", "css"))
HEADERS = {
    # Observable Plot writes its style into its pictures; a picture is saved by way of a blob.
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class File(NamedTuple):
    """What is sent: its kind and its content."""

    kind: str
    content: bytes


class Server(ThreadingHTTPServer):
    """Answers about a mission, at an address that holds a secret."""

    daemon_threads = True
    allow_reuse_address = os.name == "posix"  # Elsewhere two servers would share a port

    def __init__(self, mission: Mission, port: int = 0) -> None:
        refuse_many(mission)
        self.token = secrets.token_urlsafe(24)
        self.files = {
            "": File(HTML, text("index.html").encode()),
            "page.js": File(CODE, text("page.js").encode()),
            "explorer.js": File(CODE, script().encode()),
            "explorer.css": File(STYLE, text("explorer.css").encode()),
        }
        try:
            super().__init__((HERE, port), Handler)
        except (OSError, OverflowError) as error:
            words = "is no port" if isinstance(error, OverflowError) else error.strerror
            raise InputError([Fault("port", str(port), f"cannot be served at: {words}")]) from error
        self.worker = Worker(mission)

    def handle_error(self, *where: Any) -> None:
        """Nothing if the browser has gone: a moved slider needs no answer to its last place."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(*where)

    def server_close(self) -> None:
        """Close the port, and end the process that answers."""
        super().server_close()
        if hasattr(self, "worker"):  # not where the port is another's
            self.worker.end()

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://{HERE}:{self.server_port}/{self.token}/"


class Handler(BaseHTTPRequestHandler):
    """One request: a file of the page, or an answer."""

    server: Server
    timeout = SILENCE_S
    server_version, sys_version = "optuav", ""

    def do_GET(self) -> None:
        """Send a file of the page."""
        name = self._name()
        if name is None:
            return
        if (file := self.server.files.get(name)) is None:
            self._refuse(HTTPStatus.NOT_FOUND, "there is no such file")
        else:
            self._send(HTTPStatus.OK, file)

    def do_POST(self) -> None:
        """Send the answer to a state."""
        name = self._name()
        if name is None:
            return
        if name != "answers":
            self._refuse(HTTPStatus.NOT_FOUND, "there is nothing to ask here")
        elif self.headers.get_content_type() != "application/json":
            self._refuse(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "a state is sent as JSON")
        elif not (length := self.headers.get("Content-Length", "")).isdecimal():
            self._refuse(HTTPStatus.LENGTH_REQUIRED, "the length of the state is not stated")
        elif int(length[:20]) > LARGEST_BYTES:
            words = f"a state has at most {LARGEST_BYTES} bytes"
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, words)
        else:
            self._answer(self.rfile.read(int(length)))

    def _answer(self, body: bytes) -> None:
        """Send the answer to the state in a body."""
        try:
            state = parse_json(body.decode("utf-8", "replace"), "state")
        except InputError as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
            return
        self._send_json(HTTPStatus.OK, self.server.worker.ask(state))

    def _name(self) -> str | None:
        """The name below the token; None where the request was refused."""
        port = self.server.server_port
        hosts = {f"{name}:{port}" for name in (HERE, "localhost")}
        origin = self.headers.get("Origin")
        if self.headers.get("Host") not in hosts:
            # Another name may lead here too, by which another page would pass for this one.
            self._refuse(HTTPStatus.FORBIDDEN, "another host is asked for")
        elif origin is not None and origin.removeprefix("http://") not in hosts:
            self._refuse(HTTPStatus.FORBIDDEN, "another page asks")
        else:
            _, token, *rest = self.path.partition("?")[0].split("/", 2)
            if rest and secrets.compare_digest(token.encode(), self.server.token.encode()):
                return rest[0]
            words = "the address is not the one that optuav explore printed"
            self._refuse(HTTPStatus.NOT_FOUND, words)
        return None

    def _refuse(self, status: HTTPStatus, words: str) -> None:
        """Send words on what is wrong."""
        self.close_connection = True
        self._send_json(status, {"faults": [{"key": "", "words": words}]})

    def _send_json(self, status: HTTPStatus, data: dict[str, Any]) -> None:
        content = json.dumps(data, ensure_ascii=False, allow_nan=False).encode()
        self._send(status, File("application/json", content))

    def _send(self, status: HTTPStatus, file: File) -> None:
        self.send_response(status)
        self.send_header("Content-Type", file.kind)
        self.send_header("Content-Length", str(len(file.content)))
        self.end_headers()
        self.wfile.write(file.content)

    def end_headers(self) -> None:
        """As of every answer, with what keeps the page to itself."""
        for name, value in HEADERS.items():
            self.send_header(name, value)
        super().end_headers()

    def log_message(self, *_: object) -> None:
        """Nothing: the address is a secret."""
