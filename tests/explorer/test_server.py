"""The explorer's server: for this machine and this address alone, and whole answers."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest

import optuav
from optuav.explorer.server import LARGEST_BYTES, Server
from optuav.explorer.worker import Worker, Workers
from tests.cli.run import refused

JSON = {"Content-Type": "application/json"}


class Answer(NamedTuple):
    """What the server sent."""

    status: int
    headers: Any
    body: str


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with Server(optuav.load("paper")) as serving:
        threading.Thread(target=serving.serve_forever, args=(0.01,), daemon=True).start()
        yield serving
        serving.shutdown()


def ask(server: Server, method: str, path: str, body: str | None = None, **headers: str) -> Answer:
    """What the server sends for a path below its token."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=20)
    stated = {name.replace("_", "-"): value for name, value in headers.items()}
    place = path if path.startswith("/") else f"/{server.token}/{path}"
    connection.request(method, place, body, stated)
    answer = connection.getresponse()
    found = Answer(answer.status, answer.headers, answer.read().decode())
    connection.close()
    return found


def test_the_page_and_its_files_are_sent(server: Server) -> None:
    kinds = {
        "": "html",
        "page.js": "javascript",
        "explorer.js": "javascript",
        "explorer.css": "css",
    }
    for name, kind in kinds.items():
        found = ask(server, "GET", name)
        assert found.status == 200
        assert found.headers["Content-Type"] == f"text/{kind}; charset=utf-8"
    assert "export default {render}" in ask(server, "GET", "explorer.js?again").body


def test_nothing_of_another_host_is_named(server: Server) -> None:
    """The page works without a network: all that it loads is relative."""
    page = ask(server, "GET", "").body + ask(server, "GET", "page.js").body
    assert not re.search(r"(?:src|href|from|fetch)\W{1,3}(?:https?:)?//", page)


def test_every_answer_keeps_the_page_to_itself(server: Server) -> None:
    for found in (ask(server, "GET", ""), ask(server, "GET", "/"), ask(server, "PUT", "answers")):
        assert found.headers["Content-Security-Policy"].startswith("default-src 'self';")
        assert "frame-ancestors 'none'" in found.headers["Content-Security-Policy"]
        assert found.headers["X-Content-Type-Options"] == "nosniff"
        assert found.headers["Referrer-Policy"] == "no-referrer"
        assert "Access-Control-Allow-Origin" not in found.headers


def test_a_state_is_answered(server: Server) -> None:
    state = json.dumps({"changes": {"limits.deadline_s": 800}, "perspective": "battery"})
    found = json.loads(ask(server, "POST", "answers", state, **JSON).body)
    assert found["verdict"]["text"].startswith("688.85 s of hover promised")
    faulty = ask(server, "POST", "answers", '{"changes": {"limits.deadline_s": -1}}', **JSON)
    assert faulty.status == 200
    assert "0 < x <= 1e7 [s]" in json.loads(faulty.body)["faults"][0]["words"]


@pytest.mark.parametrize(
    "path", ["/", "/answers", "/x/", "/x/answers", "/{token}", "/{token}x/", "/%00/", "//"]
)
def test_without_the_token_there_is_nothing(server: Server, path: str) -> None:
    """Not the page, not an answer; and the token is not told."""
    place = path.replace("{token}", server.token)
    for method in ("GET", "POST"):
        found = ask(server, method, place, "{}", **JSON)
        assert found.status == 404
        assert server.token not in found.body


@pytest.mark.parametrize(
    "name",
    [
        "../server.py",
        "../../../pyproject.toml",
        "vendor/d3.min.js",
        "%2e%2e/server.py",
        "index.html",
    ],
)
def test_only_the_files_of_the_page_are_sent(server: Server, name: str) -> None:
    assert ask(server, "GET", name).status == 404


@pytest.mark.parametrize("host", ["example.org", "example.org:80", "", "127.0.0.1", "[::1]:1"])
def test_another_host_is_refused(server: Server, host: str) -> None:
    """A name that leads here, by which a page from elsewhere would pass for this one."""
    assert ask(server, "GET", "", Host=host).status == 403


@pytest.mark.parametrize("origin", ["http://example.org", "null", "https://127.0.0.1"])
def test_another_page_is_refused(server: Server, origin: str) -> None:
    assert ask(server, "POST", "answers", "{}", **JSON, Origin=origin).status == 403
    own = f"http://127.0.0.1:{server.server_port}"
    assert ask(server, "POST", "answers", "{}", **JSON, Origin=own).status == 200


def test_what_is_no_state_is_refused(server: Server) -> None:
    """By its size before it is read, by its kind, and where it is no JSON, however deep."""
    size = {"Content_Length": str(LARGEST_BYTES + 1)}
    assert ask(server, "POST", "answers", "{}", **JSON, **size).status == 413
    assert ask(server, "POST", "answers", "{}", **JSON, Content_Length="-5").status == 411
    assert ask(server, "POST", "answers", "{}", Content_Type="text/plain").status == 415
    assert ask(server, "POST", "other", "{}", **JSON).status == 404
    for length in ("1" + 4_999 * "0", 20 * "0" + "17"):
        assert ask(server, "POST", "answers", "{}", **JSON, Content_Length=length).status == 413
    for text in ("", "{", "[" * 30_000, '{"number": NaN}', "\0"):
        found = ask(server, "POST", "answers", text, **JSON)
        assert found.status in (200, 400)
        assert "faults" in json.loads(found.body)


HALF, DEEP = '"\\ud800"', "[" * 500 + "]" * 500


@pytest.mark.parametrize(
    "text",
    [
        f'{{"problem": {HALF}}}',
        f'{{"changes": {{{HALF}: 1}}}}',
        f'{{"changes": {{"limits.deadline_s": {DEEP}}}}}',
        f'{{"number": {DEEP}}}',
    ],
)
def test_a_state_that_cannot_be_repeated_is_refused_in_words(text: str, server: Server) -> None:
    """The connection stays, where an answer would repeat half a letter or no number."""
    found = ask(server, "POST", "answers", text, **JSON)
    assert found.status == 400
    assert json.loads(found.body)["faults"][0]["words"].startswith("state: is not JSON")
    found = ask(server, "POST", "answers", '{"number": 1e999}', **JSON)
    assert json.loads(found.body)["faults"][0]["key"] == "number"


def test_a_hundred_browsers_may_wait() -> None:
    """None is turned away where the server takes none for a moment, and all are answered."""
    with Server(optuav.load("paper")) as busy:
        waiting = [socket.create_connection(busy.server_address, timeout=60) for _ in range(100)]
        for each in waiting:
            words = f"GET /{busy.token}/ HTTP/1.0\r\nHost: localhost:{busy.server_port}\r\n\r\n"
            each.sendall(words.encode())
        threading.Thread(target=busy.serve_forever, args=(0.01,), daemon=True).start()
        for each in waiting:
            with each, each.makefile("rb") as answer:
                assert answer.readline().split()[1] == b"200"
        busy.shutdown()


def test_who_sends_too_much_reads_so(server: Server) -> None:
    """The words come before the connection is closed, also where all is sent first."""
    place = f"http://127.0.0.1:{server.server_port}/{server.token}/answers"
    asked = urllib.request.Request(place, b" " * 9_000_000, JSON)
    with (
        pytest.raises(urllib.error.HTTPError) as refusal,
        urllib.request.urlopen(asked, timeout=20),
    ):
        pass
    with refusal.value as answer:
        assert answer.code == 413
        assert "at most 64000 bytes" in json.loads(answer.read())["faults"][0]["words"]


@pytest.mark.parametrize(
    ("method", "headers", "status"),
    [
        ("GET", ["Host: {host}", "Host: example.org"], 403),
        ("GET", ["Host: {host}", "Host: {host}"], 403),
        ("GET", ["Host: {host}", "Origin: {host}"], 403),
        ("GET", ["Host: {host}", "Origin: http://{host}", "Origin: http://example.org"], 403),
        ("PUT", ["Host: example.org"], 403),
        *((each, ["Host: {host}"], 405) for each in ("PUT", "DELETE", "OPTIONS", "PATCH", "TRACE")),
        ("MOVE", ["Host: {host}"], 501),
    ],
)
def test_odd_requests_are_refused(
    server: Server, method: str, headers: list[str], status: int
) -> None:
    """In the same words as others, and after the same checks."""
    host = f"127.0.0.1:{server.server_port}"
    lines = [f"{method} /{server.token}/ HTTP/1.1", *headers, "", ""]
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=20) as client:
        client.sendall("\r\n".join(lines).format(host=host).encode())
        head, _, body = client.makefile("rb").read().decode().partition("\r\n\r\n")
    assert head.split()[1] == str(status)
    assert "frame-ancestors 'none'" in head
    assert json.loads(body)["faults"][0]["words"]
    assert ask(server, "HEAD", "")[0::2] == (405, "")


def test_a_port_in_use_is_one_clear_error() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        words = refused("explore", "paper", "--port", port, "--no-browser")
    assert words.startswith(f"error: --port = {port}: cannot be served at")
    assert refused("explore", "--port", "70000").startswith("error: --port = 70000: ")
    assert "shipped" in refused("explore", "nowhere")


@pytest.mark.skipif(os.name != "posix", reason="signals of a terminal are sent to groups on POSIX")
def test_it_serves_until_it_is_interrupted() -> None:
    """The whole command: it tells its address, answers there, and leaves on Ctrl-C.

    A browser that has gone before it has read an answer does not end it.
    """
    command = [sys.executable, "-m", "optuav", "explore", "--no-browser"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    # A shell's background job, which the tests may be, passes on that it ignores Ctrl-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        started = subprocess.Popen(command, start_new_session=True, **pipes)
    finally:
        signal.signal(signal.SIGINT, before)
    with started as process:
        address = process.stdout.readline().strip()
        _, _, host, token, _ = address.split("/")
        for reads in (False, True):
            connection = http.client.HTTPConnection(host, timeout=20)
            connection.request("POST", f"/{token}/answers", '{"problem": "P3"}', JSON)
            if reads:
                assert b"577.52 s of hover" in connection.getresponse().read()
            connection.close()
        os.killpg(process.pid, signal.SIGINT)
        _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert errors == "\ninterrupted\n"


def test_an_answer_that_takes_too_long_is_given_up() -> None:
    """Its process is ended; the next question is answered by a new one."""
    worker = Worker(optuav.load("paper"), longest_s=0.0)
    try:
        found = worker.ask({"number": 3})
        assert found == {"number": 3, "faults": [{"key": "", "words": found["faults"][0]["words"]}]}
        assert "no answer within 0 s" in found["faults"][0]["words"]
        worker._longest_s = 20.0
        assert worker.ask({"problem": "P3"})["verdict"]["text"].startswith("577.52 s of hover")
        worker._process.kill()
        assert "failed" in worker.ask({})["faults"][0]["words"]
    finally:
        worker.end()


def test_an_answer_that_nobody_waits_for_is_given_up() -> None:
    """Though it would take longer; and its process answers the next question."""
    worker = Worker(optuav.load("paper"), longest_s=600.0)
    try:
        worker._process.kill()
        worker._process.join()
        theirs, worker._pipe = worker._pipe, Silent()
        with pytest.raises(ConnectionAbortedError):
            worker.ask({}, wanted=lambda: worker._pipe.looks < 2)
        theirs.close()
        assert worker.ask({"problem": "P3"})["verdict"]["text"].startswith("577.52 s of hover")
    finally:
        worker.end()


class Silent:
    """A pipe by which nothing comes."""

    looks = 0

    def send(self, _: object) -> None:
        pass

    def poll(self, _: float) -> bool:
        self.looks += 1
        return False

    def close(self) -> None:
        pass


def test_a_slow_question_does_not_block_another() -> None:
    """A second process answers while the first one has not."""
    workers = Workers(optuav.load("paper"))
    slow, (first,) = threading.Event(), workers._started
    first.ask = lambda *_: {"number": 1, "slow": slow.wait(60.0)}
    answers = list[dict[str, Any]]()
    asking = threading.Thread(target=lambda: answers.append(workers.ask({})), daemon=True)
    asking.start()
    try:
        while workers._idle.queue != [None]:
            time.sleep(0.01)
        assert workers.ask({"problem": "P3"})["verdict"]["text"].startswith("577.52 s of hover")
        assert answers == []
        slow.set()
        asking.join(60.0)
        assert answers == [{"number": 1, "slow": True}]
    finally:
        slow.set()
        workers.end()
