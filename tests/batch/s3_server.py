"""moto's S3 server (PyPI) with faults: 5 % of requests fail (503, or an answer that breaks off), 5 % stall for a second.

Buckets whose name starts with `closed` deny everything, as a bucket without rights does.
"""

import random
import threading
import time

from moto.server import DomainDispatcherApplication, create_backend_app
from werkzeug.serving import make_server

DENIED = b"<?xml version='1.0'?><Error><Code>AccessDenied</Code><Message>Access Denied</Message></Error>"
BUSY = b"<?xml version='1.0'?><Error><Code>SlowDown</Code><Message>Please reduce your request rate.</Message></Error>"


class Faults:
    """Wraps a WSGI application."""

    def __init__(self, app, share):
        self.app, self.share, self.random = app, share, random.Random(7)
        self.lock = threading.Lock()
        self.counts = {"requests": 0, "failed": 0, "broken off": 0, "stalled": 0}
        self.on = False

    def draw(self, kind):
        with self.lock:
            hit = self.random.random() < self.share
            self.counts[kind] += hit
            return hit

    def __call__(self, environ, start_response):
        if environ.get("PATH_INFO", "").startswith("/closed"):
            return refuse(environ, start_response, "403 Forbidden", DENIED)
        if not self.on:
            return self.app(environ, start_response)
        with self.lock:
            self.counts["requests"] += 1
        if self.draw("stalled"):
            time.sleep(1.0)
        if self.draw("failed"):
            return refuse(environ, start_response, "503 Slow Down", BUSY)
        answer = self.app(environ, start_response)
        if environ["REQUEST_METHOD"] == "GET" and self.draw("broken off"):
            return half(answer)
        return answer


def refuse(environ, start_response, status, body):
    environ["wsgi.input"].read(int(environ.get("CONTENT_LENGTH") or 0))
    start_response(status, [("Content-Type", "application/xml"), ("Content-Length", str(len(body)))])
    return [body]


def half(answer):
    body = b"".join(answer)
    yield body[: len(body) // 2]
    raise ConnectionError("broken off on purpose")


def start(share=0.05):
    """A server on a free port; its URL and the faults."""
    faults = Faults(DomainDispatcherApplication(create_backend_app), share)
    server = make_server("127.0.0.1", 0, faults, threaded=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}", faults
