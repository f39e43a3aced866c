"""The explorer in a browser: a server for only this machine and those who know its address."""

import json
import os
import secrets
import select
import socket
import sys
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, NamedTuple

from optuav.errors import Fault, InputError
from optuav.explorer.answers import refuse_many
from optuav.explorer.static import script, style, text
from optuav.explorer.worker import Workers
from optuav.mission import Mission
from optuav.mission.files import parse_json

HERE = "127.0.0.1"
LARGEST_BYTES = 64_000  # Size of a request
LONGEST_LENGTH = 10  # Digits of a length that is read as a number
SILENCE_S = 30.0  # Silence that closes a connection
DRAINED_BYTES, DRAINING_S = 10_000_000, 2.0  # Read of a refused request
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
    """Content to send, with its kind."""

    kind: str
    content: bytes


class Server(ThreadingHTTPServer):
    """Answers about a mission, at an address that holds a secret."""

    daemon_threads = True
    allow_reuse_address = os.name == "posix"  # Elsewhere two servers would share a port
    request_queue_size = 128

    def __init__(self, mission: Mission, port: int = 0) -> None:
        refuse_many(mission)
        self.token = secrets.token_urlsafe(24)
        self.files = {
            "": File(HTML, text("index.html").encode()),
            "page.js": File(CODE, text("page.js").encode()),
            "explorer.js": File(CODE, script().encode()),
            "explorer.css": File(STYLE, style().encode()),
        }
        try:
            super().__init__((HERE, port), Handler)
        except (OSError, OverflowError) as error:
            words = f"cannot be served at: {getattr(error, 'strerror', '')}"
            if isinstance(error, OverflowError):
                words = "a whole number, 0 <= x <= 65535"
            raise InputError([Fault("port", str(port), words)]) from error
        self.workers = Workers(mission)

    def handle_error(self, *where: Any) -> None:
        """Nothing if the browser has gone: a moved slider needs no answer to its last place."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(*where)

    def server_close(self) -> None:
        """Close the port, and end the processes that answer."""
        super().server_close()
        if hasattr(self, "workers"):  # not where the port is another's
            self.workers.end()

    @property
    def address(self) -> str:
        """Address of the page."""
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
        elif not (length := self._alone("Content-Length")).isdecimal():
            self._refuse(HTTPStatus.LENGTH_REQUIRED, "the request has no length of the state")
        elif len(length) > LONGEST_LENGTH or (count := int(length)) > LARGEST_BYTES:
            words = f"a state has at most {LARGEST_BYTES} bytes"
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, words)
        else:
            self._answer(self.rfile.read(count))

    def do_PUT(self) -> None:
        """Refuse other methods."""
        if self._name() is not None:
            self._refuse(HTTPStatus.METHOD_NOT_ALLOWED, "only GET and POST are answered")

    do_DELETE = do_HEAD = do_OPTIONS = do_PATCH = do_TRACE = do_PUT

    def _answer(self, body: bytes) -> None:
        """Send the answer to the state in a body."""
        try:
            state = parse_json(body.decode("utf-8", "replace"), "state")
        except InputError as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
            return
        self._send_json(HTTPStatus.OK, self.server.workers.ask(state, self._waits))

    def _waits(self) -> bool:
        """Return whether the browser still waits for the answer."""
        try:
            readable, _, _ = select.select([self.connection], [], [], 0.0)
            return not readable or self.connection.recv(1, socket.MSG_PEEK) != b""
        except OSError:
            return False

    def _alone(self, name: str) -> str:
        """A header that is stated once; empty else."""
        values = self.headers.get_all(name, [])
        return str(values[0]) if len(values) == 1 else ""

    def _name(self) -> str | None:
        """The name below the token; None where the request was refused."""
        port = self.server.server_port
        hosts = {f"{name}:{port}" for name in (HERE, "localhost")}
        origins = self.headers.get_all("Origin", [])
        if self._alone("Host") not in hosts:
            # Another name may lead here too, and let another page pass for this one.
            self._refuse(HTTPStatus.FORBIDDEN, "another host is asked for")
        elif not {*origins} <= {f"http://{host}" for host in hosts}:
            self._refuse(HTTPStatus.FORBIDDEN, "another page asks")
        else:
            _, token, *rest = self.path.partition("?")[0].split("/", 2)
            if rest and secrets.compare_digest(token.encode(), self.server.token.encode()):
                return rest[0]
            words = "the address is not the one that optuav explore printed"
            self._refuse(HTTPStatus.NOT_FOUND, words)
        return None

    def _refuse(self, status: HTTPStatus, words: str) -> None:
        """Send words on the fault."""
        self.send_error(status, words)
        if self.headers.get("Content-Length") or self.headers.get("Transfer-Encoding"):
            self._drain()

    def _drain(self) -> None:
        """Read the rest of a request: a closed connection would overtake the words."""
        left, end_s = DRAINED_BYTES, time.monotonic() + DRAINING_S
        self.connection.settimeout(DRAINING_S)
        try:
            self.connection.shutdown(socket.SHUT_WR)
            while (
                left > 0 and time.monotonic() < end_s and (some := self.rfile.read1(LARGEST_BYTES))
            ):
                left -= len(some)
        except OSError:
            return  # The sender has gone

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Send words on the fault, also for requests that the library refuses."""
        self.close_connection = True
        status = HTTPStatus(code)
        self._send_json(status, {"faults": [{"key": "", "words": message or status.phrase}]})

    def _send_json(self, status: HTTPStatus, data: dict[str, Any]) -> None:
        content = json.dumps(data, ensure_ascii=False, allow_nan=False).encode()
        self._send(status, File("application/json", content))

    def _send(self, status: HTTPStatus, file: File) -> None:
        self.send_response(status)
        self.send_header("Content-Type", file.kind)
        self.send_header("Content-Length", str(len(file.content)))
        if status == HTTPStatus.METHOD_NOT_ALLOWED:
            self.send_header("Allow", "GET, POST")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(file.content)

    def end_headers(self) -> None:
        """End the headers as usual, with headers that keep the page to itself."""
        for name, value in HEADERS.items():
            self.send_header(name, value)
        super().end_headers()

    def log_message(self, *_: object) -> None:
        """Nothing: the address is a secret."""
