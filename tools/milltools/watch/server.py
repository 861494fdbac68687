"""The server of `mill watch`: one page and its data, for the user's own browser only.

It listens on 127.0.0.1. Every path begins with a random token, which other users of the computer and other pages do
not know; a request with another Host header is refused, so a name of somebody else's that leads to 127.0.0.1 does not
help (DNS rebinding).
"""

import contextlib
import functools
import hmac
import http
import http.server
import json
import secrets
import socket
import sys
import threading
import time
import urllib.parse

from milltools import pages
from milltools.base.answer import for_json
from milltools.base.errors import UserError
from milltools.watch.follow import Follower

HOME = "127.0.0.1"
PATIENCE = 10  # [s] for a request to arrive whole, and for each part of an answer to be taken
MOST = 64  # connections whose request has not arrived
HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",  # the address holds the token
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class Handler(http.server.BaseHTTPRequestHandler):
    timeout = PATIENCE
    server_version, sys_version = "mill", ""
    policy = pages.declared("")

    def do_GET(self):
        self.server.waiting.pop(self.connection, None)
        path, _, query = self.path.partition("?")
        token, _, name = path.removeprefix("/").partition("/")
        if self.headers.get_all("Host") not in ([f"{name}:{self.server.server_port}"] for name in (HOME, "localhost")):
            return self.send_error(http.HTTPStatus.FORBIDDEN, "Not the address of this server")
        if not hmac.compare_digest(token.encode(errors="replace"), self.server.token.encode()):
            return self.send_error(http.HTTPStatus.NOT_FOUND)
        if name == "":
            self.policy = pages.declared(self.server.page)
            return self._send("text/html", self.server.page)
        if name not in ("mill.json", "state"):
            return self.send_error(http.HTTPStatus.NOT_FOUND)
        try:
            asked = urllib.parse.parse_qs(query)
            since, seen = (int(asked.get(word, ["-1"])[0]) for word in ("since", "seen"))
            if max(since, seen) >= 2**31:
                raise ValueError
        except ValueError:
            return self.send_error(http.HTTPStatus.BAD_REQUEST, "Expected whole numbers")
        answer = self.server.mill() if name == "mill.json" else self.server.state(since, seen)
        self._send("application/json", json.dumps(for_json(answer), allow_nan=False, separators=(",", ":")))

    def _send(self, kind, text):
        data = text.encode()
        self.send_response(http.HTTPStatus.OK)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def end_headers(self):
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.send_header("Content-Security-Policy", f"{self.policy}; frame-ancestors 'none'")
        super().end_headers()

    def log_message(self, *_):
        """Nothing: the terminal belongs to the command."""


class Server(http.server.ThreadingHTTPServer):
    """Serves a page with the data of a Follower in threads of its own: a context manager. `page(place)`: the text of
    the page whose data are below the path `place`. port: 0 for a free one."""

    daemon_threads = True
    request_queue_size = MOST

    def __init__(self, follower: Follower, page, port: int = 0):
        self.follower, self.token = follower, secrets.token_urlsafe(24)
        self.make = page
        self.asked = 0.0  # [s] monotonic time of the last request for states
        self.told = False  # a page knows that the run has ended
        self.waiting = {}  # connection: [s] monotonic time at which it was opened, until its request is there
        try:
            super().__init__((HOME, port), Handler)
        except (OSError, OverflowError) as fault:
            why = getattr(fault, "strerror", None) or fault
            raise UserError(f"--port {port}: {why}; without --port a free port is taken", status=1) from None

    @property
    def address(self) -> str:
        return f"http://{HOME}:{self.server_port}/{self.token}/"

    @functools.cached_property
    def page(self) -> str:
        """Made when it is first asked for: this takes seconds, and a run may begin meanwhile."""
        return self.make(f"/{self.token}/")

    def __enter__(self):
        threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True).start()
        return self

    def __exit__(self, *_):
        self.shutdown()
        self.server_close()

    def server_bind(self):
        # HTTPServer's own asks the name server for this computer's name
        super(http.server.HTTPServer, self).server_bind()
        self.server_name, self.server_port = self.server_address[:2]

    def process_request(self, request, client_address):
        """Of too many connections that send nothing, the oldest are closed."""
        self.waiting[request] = time.monotonic()
        for late in list(self.waiting)[:-MOST]:
            self._drop(late)
        super().process_request(request, client_address)

    def service_actions(self):
        for request, opened in list(self.waiting.items()):
            if time.monotonic() - opened > PATIENCE:
                self._drop(request)

    def shutdown_request(self, request):
        self.waiting.pop(request, None)
        super().shutdown_request(request)

    def _drop(self, request):
        """Ends a connection: its thread, which reads, sees the end."""
        self.waiting.pop(request, None)
        with contextlib.suppress(OSError):  # it has just ended by itself
            request.shutdown(socket.SHUT_RDWR)

    def handle_error(self, request, client_address):
        """Silent if the page went away in the middle of an answer."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)

    def mill(self) -> dict:
        try:
            name, message = self.follower.mill()
        except UserError as fault:
            return {"mill": "", "message": {"type": "failed", "lines": fault.lines}}
        return {"mill": name, "message": message}

    def state(self, since, seen) -> dict:
        answer = self.follower.answer(since, seen)
        self.asked = time.monotonic()
        self.told = answer["ended"]
        return answer

    def linger(self, most: float):
        """Gives a page that is open `most` seconds to learn that the run has ended."""
        end = time.monotonic() + most
        while not self.told and time.monotonic() - self.asked < most and time.monotonic() < end:
            time.sleep(0.1)
