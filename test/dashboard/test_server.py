"""The server: reads only, answers to its own names only, the same for all who look, and ends well."""

import logging
import re
import socket
from contextlib import ExitStack, suppress
from itertools import product

import pytest
from heard_leg import walk
from live_browser import wait_for

pytest.importorskip("tornado")

from leg_wear_monitor.dashboard import hub as hubs
from leg_wear_monitor.dashboard import server as servers
from leg_wear_monitor.dashboard.server import listen
from leg_wear_monitor.errors import LegWearError

pytestmark = pytest.mark.plain

WRITES = ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "PROPFIND", "CONNECT", "x"]


def test_the_page_comes_with_a_policy_that_lets_nothing_else_in(leg, served):
    code, headers, html = served(leg).ask("/")
    assert code == 200
    assert html == leg.content().html
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; ")
    assert "unsafe" not in policy and "http" not in policy and "*" not in policy
    assert "connect-src 'self'" in policy and "frame-ancestors 'none'" in policy
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Cache-Control"] == "no-store"
    assert "Server" not in headers
    assert " src=" not in html and '<link rel="stylesheet' not in html


def test_writes_are_refused(leg, served):
    dashboard = served(leg)
    for method, path in product(WRITES, ["/", "/events", "/legs/a/report.html", "/other"]):
        code, headers, text = dashboard.ask(path, method, body=b"x=1")
        assert code in (405, 400), (method, path)  # what is no method at all is no request
        if code == 405:
            assert headers["Allow"] == "GET, HEAD", (method, path)
        assert "x=1" not in text, (method, path)


def test_head_is_as_get_without_a_body(leg, served):
    dashboard = served(leg)
    for path, code in (("/", 200), ("/events", 200), ("/nothing", 404)):
        found, _, text = dashboard.ask(path, "HEAD")
        assert (found, text) == (code, "")


PATHS = ["/../etc/passwd", "/%2e%2e/etc/passwd", "/legs/../../etc/passwd", "/legs/..%2f..%2fx/report.html",
         "/legs/%00/report.html", "/legs//report.html", "//evil.example/", "/index.html", "/events/",
         "/<script>"]  # fmt: skip


def test_there_is_no_other_path(leg, served):
    dashboard = served(leg)
    for path in PATHS:
        code, _, text = dashboard.ask(path)
        assert (code, text) == (404, "404 Not Found\n"), path


def test_the_guide_of_the_verdict_is_a_page_that_leads_on(leg, served):
    dashboard = served(leg)
    _, _, page = dashboard.ask()
    guide = re.search(r'href="(/docs/howto/verdict/[a-z_]+\.md)"', page)[1]
    code, headers, html = dashboard.ask(guide)
    assert code == 200 and "script-src" not in headers["Content-Security-Policy"]
    assert headers["Content-Type"].startswith("text/html")
    assert '<a href="../measure_clearance.md">' in html
    assert dashboard.ask("/docs/howto/measure_clearance.md")[0] == 200
    for path in ("/docs/nowhere.md", "/docs/howto/../../setup.md", "/docs//etc/passwd.md", "/docs/conf.py"):
        assert dashboard.ask(path)[0] == 404, path


def test_another_name_is_refused(leg, served):
    dashboard = served(leg)
    hosts = ("evil.example", f"evil.example:{dashboard.port}", "", "127.0.0.1.evil.example")
    for path, host in product(["/", "/events", "/legs/a/report.html"], hosts):
        code, _, text = dashboard.ask(path, Host=host)
        assert (code, text) == (403, "403 Forbidden\n"), (path, host)
    assert dashboard.ask("/", Host=f"localhost:{dashboard.port}")[0] == 200


def test_a_page_of_another_site_may_link_here_and_not_read(leg, served):
    dashboard = served(leg)
    assert dashboard.ask("/events", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="cors")[0] == 403
    code, headers, _ = dashboard.ask("/", Sec_Fetch_Site="cross-site", Sec_Fetch_Mode="navigate")
    assert code == 200
    assert not [name for name in headers if name.startswith("Access-Control")]


def test_two_who_look_see_the_same_and_what_changes(leg, served):
    dashboard = served(leg)
    with dashboard.events() as one, dashboard.events() as other:
        first = [next(one), next(other)]
        assert first[0]["regions"] == first[1]["regions"] == leg.content().regions
        walk(leg, 20, clearance_m=5.0e-4)
        states = [next(state for state in each if state["regions"]) for each in (one, other)]
        assert states[0]["regions"] == states[1]["regions"]
        assert "0.500" in states[0]["regions"]["joints"]
        assert "belief" not in states[0]["regions"]  # it is as it was
        assert dashboard.hub.viewers == 2


def test_a_word_comes_without_news_and_who_goes_is_forgotten(leg, served, clock):
    dashboard = served(leg)
    with dashboard.events() as states:
        assert next(states)["age_s"] == 0.0
        clock.now_s += 3.0
        assert next(state for state in states if state["age_s"] == 3.0)["regions"] == {}
    wait_for(lambda: dashboard.hub.viewers == 0, "nobody to look")


def test_there_are_not_more_viewers_than_it_can_serve(leg, served, monkeypatch):
    monkeypatch.setattr(hubs, "MOST_VIEWERS", 1)
    dashboard = served(leg)
    with dashboard.events() as states:
        next(states)
        assert dashboard.ask("/events")[0] == 503
        assert dashboard.ask("/")[0] == 200


def test_connections_that_ask_nothing_are_capped_and_sent_away(leg, served, monkeypatch):
    monkeypatch.setattr(servers, "MOST_CONNECTIONS", 5)
    monkeypatch.setattr(servers, "_IDLE_S", 0.5)
    dashboard = served(leg)
    with ExitStack() as stack:
        idle = [
            stack.enter_context(socket.create_connection(("127.0.0.1", dashboard.port), timeout=30))
            for _ in range(20)
        ]
        idle[0].sendall(b"GET / HTTP/1.1\r\nHost:")  # and no more
        idle[1].sendall(b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n")
        for connection in idle[5:]:
            assert connection.recv(1) == b""
        for connection in idle[:5]:
            while connection.recv(100):
                continue
        assert dashboard.ask("/")[0] == 200


REQUESTS = [
    b"GET /legs/%ff%fe/report.html HTTP/1.1", b"GET /docs/%ff.md HTTP/1.1", b"\xff\xfe / HTTP/1.1",
    b"GET /?\x1b[2J=%ff HTTP/1.1", b"GET / HTTP/9", b"x" * 20_000,
    b"POST / HTTP/1.1\r\nContent-Length: -1", b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked",
    b"GET / HTTP/1.1\r\nContent-Length: 99999999",
]  # fmt: skip


def test_no_request_writes_a_line(leg, served, caplog):
    dashboard = served(leg)
    for request in REQUESTS:
        with socket.create_connection(("127.0.0.1", dashboard.port), timeout=30) as connection:
            connection.sendall(request + b"\r\nHost: localhost\r\nConnection: close\r\n\r\nzz\r\n")
            with suppress(ConnectionResetError):
                while connection.recv(4096):
                    continue
        assert dashboard.ask("/")[0] == 200, request
        lines = [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]
        assert lines == [], request


def test_a_rendering_serves_all(leg, served, monkeypatch):
    """However many look, the content is made once for each change."""
    monkeypatch.setattr(hubs, "_TICK_S", 0.5)  # all of a second's messages come within it
    made = []
    content = leg.content
    monkeypatch.setattr(leg, "content", lambda: made.append(1) or content())
    dashboard = served(leg)
    with dashboard.events() as one, dashboard.events() as two, dashboard.events() as three:
        for states in (one, two, three):
            next(states)
        assert len(made) == 1
        walk(leg, 30, clearance_m=5.5e-4)
        for states in (one, two, three):
            next(state for state in states if state["regions"])
        assert len(made) == 2


def test_a_port_in_use_is_one_line():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        fault = rf"--port: 127\.0\.0\.1:{port} cannot be used: .*in use"
        with pytest.raises(LegWearError, match=fault):
            listen("127.0.0.1", port)
    with pytest.raises(LegWearError, match="--host"):
        listen("no.such.host.invalid", 0)
