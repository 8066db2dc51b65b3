"""Requests, connections and names that attack a dashboard: it answers afterwards, and writes no line."""

import asyncio
import os
import resource
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import numpy as np
import tornado  # noqa: F401 - without it, the family is left out

from campaign.case import Case, Outcome
from leg_wear_monitor.dashboard import server
from leg_wear_monitor.dashboard.hub import Hub
from leg_wear_monitor.dashboard.ledger_leg import LedgerLeg
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.entry import binding_of
from leg_wear_monitor.monitor.ledger.ledger import Ledger

SHORT, LONG = 12, 600

_CONFIG = MonitorConfig(hardware_id="left")
_DESCRIPTORS = 400  # of the server; twice as many connections are opened
_PATHS = ("/", "/events", "/legs/{}/report.html", "/docs/{}.md", "/{}", "//{}", "*", "http://evil/{}")
_HEADS = ("Host: localhost", "Host: evil", "Host: \xff", "Connection: keep-alive", "Content-Length: {}",
          "Transfer-Encoding: chunked", "Expect: 100-continue", "Sec-Fetch-Site: cross-site", "{}: {}",
          "Content-Encoding: gzip", "Range: bytes=0-{}", "X: " + 20_000 * "x")  # fmt: skip

Generator = np.random.Generator


def warm() -> None:
    """Load the mechanism."""
    load_mechanism()


def case(seed: int) -> Case:
    """An attack of one of the kinds."""
    name, kind = list(_KINDS.items())[seed % len(_KINDS)]
    return Case(
        description=name,
        run=lambda directory: _attacked(directory, kind, np.random.default_rng(seed)),
        memory_mb=150.0,
    )


def _attacked(
    directory: Path, attack: Callable[[int, Generator], None], rng: Generator
) -> tuple[Outcome, str]:
    server._IDLE_S = 1.0
    path = directory / "wear.ledger"
    leg = fitted(load_mechanism(), _CONFIG)
    Ledger(path, binding_of(leg, _CONFIG), 5.0).close()
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (_DESCRIPTORS, limits[1]))
    place = server.listen("127.0.0.1", 0)
    attacker = os.fork()
    if not attacker:  # with descriptors of its own
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, limits)
            attack(place.port, rng)
        finally:
            os._exit(0)
    with _served(LedgerLeg(path, _CONFIG, leg, time.time), place) as port:
        os.waitpid(attacker, 0)
        answer = b""
        for _ in range(100):  # connections that were left idle end first
            with suppress(OSError):
                answer = _answer(port, b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            if answer:
                break
            time.sleep(0.1)
    if not answer.startswith(b"HTTP/1.1 200"):
        return Outcome.SILENT, f"it answers {answer[:60]!r}"
    stderr = (directory.parent / "stderr").read_text(errors="replace")
    return (Outcome.SILENT, f"{len(stderr)} characters: {stderr[:200]}") if stderr else (Outcome.SOUND, "")


# --- attacks, in a process of their own ---


def _requests(port: int, rng: Generator) -> None:
    """Requests put together at random."""
    for _ in range(40):
        text = bytes(rng.integers(0, 256, int(rng.integers(0, 9)), dtype=np.uint8)).decode("latin-1")
        text = str(rng.choice([text, "%ff%fe", "..%2f", "%00", "a", "-1", "99999999999999999999"]))
        method = str(rng.choice(["GET", "HEAD", "POST", "TRACE", "\x1b[2J", ""]))
        heads = rng.choice(_HEADS, int(rng.integers(1, 5)))
        lines = [f"{method} {rng.choice(_PATHS)} HTTP/{rng.choice(['1.1', '1.0', '9'])}", *map(str, heads)]
        request = "\r\n".join(line.replace("{}", text) for line in lines) + "\r\n\r\n"
        with suppress(OSError):
            _answer(port, request.encode("latin-1", "replace"), 0.2)


def _garbage(port: int, rng: Generator) -> None:
    """Random bytes."""
    for _ in range(40):
        with suppress(OSError):
            _answer(port, rng.bytes(int(rng.integers(1, 40_000))), 0.05)


def _idle(port: int, rng: Generator) -> None:
    """More connections than descriptors, which say nothing, or begin to."""
    begun = (b"", b"G", b"GET / HTTP/1.1\r\nHost:", b"POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\n")
    with ExitStack() as stack, suppress(OSError):
        for _ in range(2 * _DESCRIPTORS):
            one = stack.enter_context(socket.create_connection(("127.0.0.1", port), timeout=1.0))
            one.sendall(begun[int(rng.integers(len(begun)))])


def _takes_nothing(port: int, rng: Generator) -> None:
    """Who asks for pages, and reads nothing of them."""
    server._WRITE_S = 1.0
    request = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with ExitStack() as stack, suppress(OSError):
        for _ in range(int(rng.integers(5, 30))):
            one = socket.socket()
            one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            stack.enter_context(one).connect(("127.0.0.1", port))
            one.sendall(int(rng.integers(1, 40)) * request)
        time.sleep(1.5)


_KINDS: dict[str, Callable[[int, Generator], None]] = {
    "requests": _requests,
    "garbage": _garbage,
    "idle connections": _idle,
    "takes nothing": _takes_nothing,
}


def _answer(port: int, request: bytes, timeout_s: float = 10.0) -> bytes:
    """What comes back."""
    with socket.create_connection(("127.0.0.1", port), timeout=timeout_s) as connection:
        connection.sendall(request)
        return connection.recv(4096)


@contextmanager
def _served(source: LedgerLeg, place: server.Place) -> Iterator[int]:
    """A dashboard in a thread; its port."""
    handed, is_ready = [], threading.Event()

    async def run() -> None:
        def ready(ended: asyncio.Event) -> None:
            handed.extend([asyncio.get_running_loop(), ended])
            is_ready.set()

        await server.serve(Hub(source), place, ready)

    thread = threading.Thread(target=lambda: asyncio.run(run()))
    thread.start()
    is_ready.wait(30.0)
    try:
        yield place.port
    finally:
        handed[0].call_soon_threadsafe(handed[1].set)
        thread.join(30.0)
