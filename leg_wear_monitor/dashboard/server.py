"""The web server: one page and its events, for reading only."""

import asyncio
import ipaddress
import socket
from collections.abc import Callable, Sequence
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

import attrs
from tornado.httpserver import HTTPServer
from tornado.iostream import StreamClosedError
from tornado.web import Application, HTTPError, RequestHandler

from leg_wear_monitor.dashboard.hub import Hub
from leg_wear_monitor.errors import LegWearError, printable

_WRITE_S = 20.0  # a viewer that reads nothing for this time is disconnected
_IDLE_S = 20.0  # a connection without a whole request for this time is closed; the browser opens a new one
_REQUEST_BYTES = 16_384
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


@attrs.frozen
class Place:
    """Address and sockets of a server.

    Attributes
    ----------
    host : str
        Name or address of the server.
    sockets : sequence of socket.socket
    """

    host: str
    sockets: Sequence[socket.socket]

    @property
    def port(self) -> int:
        """The port."""
        return int(self.sockets[0].getsockname()[1])

    @property
    def address(self) -> str:
        """Address of the server's page."""
        return f"http://{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}/"


def listen(host: str, port: int) -> Place:
    """Bind a port; 0 is any free one.

    Raises
    ------
    LegWearError
        If the port is in use or not allowed, or if the host is not an address of this machine.
    """
    try:
        return Place(host, [_bound(host, port)])
    except socket.gaierror as error:
        raise LegWearError(f"--host: {printable(host)!r} is not a host: {error.strerror}") from error
    except PermissionError as error:
        raise LegWearError(
            f"--port: {port} may not be used: {error.strerror}. Expected a port above 1023"
        ) from error
    except OSError as error:
        reason = " ".join(str(error.strerror or error).split())
        raise LegWearError(
            f"--port: {printable(host)}:{port} cannot be used: {reason}. Expected a different port, or 0 for "
            f"any free port"
        ) from error
    except UnicodeError as error:
        raise LegWearError(f"--host: {printable(host)!r} is not a host") from error


def _bound(host: str, port: int) -> socket.socket:
    """A socket that listens on the first address of a host."""
    family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    listening = socket.create_server(address[:2], family=family, backlog=128)
    listening.setblocking(False)
    return listening


async def serve(hub: Hub, place: Place, ready: Callable[[asyncio.Event], None]) -> None:
    """Serve until the event that `ready` is given is set.

    Parameters
    ----------
    hub : Hub
    place : Place
    ready : callable
        Called once the page can be loaded.
    """
    ended = asyncio.Event()
    server = HTTPServer(
        application(hub, place.host),
        idle_connection_timeout=_IDLE_S,
        body_timeout=_IDLE_S,
        max_header_size=_REQUEST_BYTES,
        max_body_size=_REQUEST_BYTES,
    )
    server.add_sockets(list(place.sockets))
    renewing = asyncio.create_task(hub.run())
    renewing.add_done_callback(lambda _: ended.set())
    try:
        ready(ended)
        await ended.wait()
    finally:
        hub.close()
        server.stop()
        await renewing  # raises the error that ended it, if any
        await server.close_all_connections()
        hub.finish()


def application(hub: Hub, host: str) -> Application:
    """The pages of a hub, for a server on a host."""
    common: dict[str, Any] = {"hub": hub, "host": host}
    return Application(
        [
            (r"/", _Page, common),
            (r"/events", _Events, common),
        ],
        default_handler_class=_Nothing,
        default_handler_args=common,
        log_function=lambda _: None,
    )


class _Reading(RequestHandler):
    """Answers read requests that use a name of this server."""

    SUPPORTED_METHODS = ("GET", "HEAD")

    def initialize(self, hub: Hub, host: str) -> None:
        self._hub, self._host = hub, host

    def set_default_headers(self) -> None:
        self.clear_header("Server")
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        if not is_allowed(self.request.headers.get("Host", ""), self._host):
            raise HTTPError(HTTPStatus.FORBIDDEN)
        if self.request.headers.get("Sec-Fetch-Site") == "cross-site" and not self._is_navigation:
            raise HTTPError(HTTPStatus.FORBIDDEN)

    @property
    def _is_navigation(self) -> bool:
        """True if a browser follows a link; False if a script of a page reads data."""
        return self.request.headers.get("Sec-Fetch-Mode") == "navigate"

    def write_error(self, status_code: int, **_: Any) -> None:
        """Answer with one line that repeats nothing from the request."""
        if status_code == HTTPStatus.METHOD_NOT_ALLOWED:
            self.set_header("Allow", ", ".join(self.SUPPORTED_METHODS))
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{status_code} {HTTPStatus(status_code).phrase}\n")

    def log_exception(self, kind: Any, value: Any, trace: Any) -> None:
        """Log no line for a refused request, because clients could fill a disk; log faults of the server.

        Requests that are cut off by the end of the server are not faults.
        """
        if not isinstance(value, HTTPError) and not self._hub.is_closing:
            super().log_exception(kind, value, trace)


class _Page(_Reading):
    async def get(self) -> None:
        content = await self._hub.content()
        self.set_header("Content-Security-Policy", f"{content.policy}; frame-ancestors 'none'")
        self.set_header("Content-Type", "text/html; charset=utf-8")
        try:
            await asyncio.wait_for(self.finish(content.html), _WRITE_S)
        except (StreamClosedError, TimeoutError):
            self.request.connection.stream.close()  # type: ignore[union-attr]

    head = get


class _Events(_Reading):
    async def get(self) -> None:
        viewer = self._hub.join()
        if viewer is None:
            raise HTTPError(HTTPStatus.SERVICE_UNAVAILABLE)
        self._bell = viewer.bell
        self.set_header("Content-Type", "text/event-stream; charset=utf-8")
        try:
            while not self._hub.is_closing and not self.request.connection.stream.closed():  # type: ignore[union-attr]
                await viewer.bell.wait()
                viewer.bell.clear()
                self.write(await self._hub.message(viewer))
                await asyncio.wait_for(self.flush(), _WRITE_S)
        except (StreamClosedError, TimeoutError):
            self.request.connection.stream.close()  # type: ignore[union-attr]
        finally:
            self._hub.leave(viewer)

    def head(self) -> None:
        self.set_header("Content-Type", "text/event-stream; charset=utf-8")

    def on_connection_close(self) -> None:
        """Wake up, to end."""
        if hasattr(self, "_bell"):
            self._bell.set()


class _Nothing(_Reading):
    def prepare(self) -> None:
        super().prepare()
        raise HTTPError(HTTPStatus.NOT_FOUND)


# Server names that a request may use: a different site must not reach the server under its own name.
#
# A different site can let its name point to this machine (DNS rebinding), and its page then reads the
# server's answers. An address cannot be misused like this, and neither can this machine's own names.


def is_local(host: str) -> bool:
    """True if a server bound to a host can be reached from this machine only."""
    return host == "localhost" or _is_loopback(host)


def is_allowed(header: str, host: str) -> bool:
    """True if the Host header of a request names this server, which is bound to a host."""
    try:
        asked = (urlsplit(f"//{header}").hostname or "").rstrip(".")
    except ValueError:
        return False
    if is_local(host):
        return asked == "localhost" or _is_loopback(asked)
    own = socket.gethostname().lower()
    return asked in {"localhost", host.lower(), own, f"{own}.local"} or _is_address(asked)


def _is_address(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True


def _is_loopback(text: str) -> bool:
    return _is_address(text) and ipaddress.ip_address(text).is_loopback
