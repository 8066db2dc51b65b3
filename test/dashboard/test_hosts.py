"""Host headers: names and addresses of this machine are answered, names that others can turn are not."""

import socket

import pytest

from leg_wear_monitor.dashboard.hosts import is_allowed, is_local, own_names

pytestmark = pytest.mark.plain

BAD = (
    "evil.example", "localhost.evil.example", "192.168.1.4:8350", "127.0.0.1.nip.io", "", "a b",
    "[::1].evil.example",
    "localhost:8350@evil.example", "127.0.0.1:80:80", "localhost/..", "2130706433x",
)  # fmt: skip
MINE = socket.gethostname().lower()


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "127.0.0.5"])
def test_a_local_server_answers_to_local_names_only(host):
    assert is_local(host)
    names = own_names(host)
    for good in ("localhost", "LOCALHOST:8350", "127.0.0.1:9000", "127.9.9.9", "[::1]:8350", "localhost.:1"):
        assert is_allowed(good, host, names), good
    for bad in (*BAD, f"{MINE}.example"):
        assert not is_allowed(bad, host, names), bad


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.4", "robot"])
def test_an_open_server_answers_to_addresses_and_its_names(host):
    assert not is_local(host)
    names = own_names(host)
    for good in ("192.168.1.4:8350", "[fe80::1]:8350", "localhost", MINE, f"{MINE}.local:8350"):
        assert is_allowed(good, host, names), good
    for bad in ("evil.example", f"{MINE}.evil.example", "evil"):
        assert not is_allowed(bad, host, names), bad
