"""A leg as its monitor's messages tell it, and a dashboard that is served."""

import asyncio
import http.client
import json
import threading
from contextlib import contextmanager

import pytest
from heard_leg import NODE, Clock, walk

from leg_wear_monitor.dashboard.leg_page import leg_setup
from leg_wear_monitor.dashboard.live_leg import LiveLeg
from leg_wear_monitor.monitor.config.settings import MonitorConfig


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture(scope="session")
def setup():
    config = MonitorConfig(hardware_id="left")
    return leg_setup(config)


@pytest.fixture
def leg(setup, clock):
    """A leg that walks for ten seconds."""
    leg = LiveLeg(NODE, [f"{NODE}/verdict"], clock, setup)
    for second in range(1, 11):
        walk(leg, second)
    return leg


class Dashboard:
    """A dashboard that is served, as a browser meets it."""

    def __init__(self, port, hub):
        self.port, self.hub, self.end = port, hub, None

    def ask(self, path="/", method="GET", body=None, **headers):
        """Status, headers and text of an answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        try:
            connection.putrequest(method, path, skip_host="Host" in headers)
            for name, value in headers.items():
                connection.putheader(name.replace("_", "-"), value)
            if body is not None:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            answer = connection.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read().decode()
        finally:
            connection.close()

    @contextmanager
    def events(self):
        """States as they come."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        try:
            connection.request("GET", "/events")
            yield states_of(connection.getresponse())
        finally:
            connection.close()


def states_of(answer):
    assert answer.status == 200
    for line in answer:
        if line.startswith(b"data: "):
            yield json.loads(line.removeprefix(b"data: "))


@pytest.fixture
def served(monkeypatch):
    """Serve a source in a thread, which looks for news often; all are ended with the test."""
    pytest.importorskip("tornado")
    from leg_wear_monitor.dashboard import hub as hubs
    from leg_wear_monitor.dashboard.hub import Hub
    from leg_wear_monitor.dashboard.server import listen, serve

    monkeypatch.setattr(hubs, "_TICK_S", 0.05)
    running = []

    def start(source, host="127.0.0.1"):
        is_ready, handed = threading.Event(), []

        async def run():
            hub, place = Hub(source), listen(host, 0)
            handed.extend([Dashboard(place.port, hub), asyncio.get_running_loop()])

            def ready(ended):
                handed.append(ended)
                is_ready.set()

            await serve(hub, place, ready)

        thread = threading.Thread(target=lambda: asyncio.run(run()))
        thread.start()
        assert is_ready.wait(30)
        dashboard, loop, ended = handed

        def end():
            if thread.is_alive():
                loop.call_soon_threadsafe(ended.set)
            thread.join(30)
            assert not thread.is_alive()

        dashboard.end = end
        running.append(dashboard)
        return dashboard

    yield start
    for dashboard in running:
        dashboard.end()
