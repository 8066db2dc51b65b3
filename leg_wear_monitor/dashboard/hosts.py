"""Server names that a request may use: a different site must not reach the server under its own name.

A different site can let its name point to this machine (DNS rebinding), and its page then reads the server's
answers. An address cannot be misused like this, and neither can this machine's own names.
"""

import ipaddress
import re
import socket

_HOST = re.compile(r"\[(?P<six>[0-9a-fA-F:.]+)\](:\d{1,5})?|(?P<name>[A-Za-z0-9._-]{1,253}?)\.?(:\d{1,5})?")


def is_local(host: str) -> bool:
    """True if a server bound to a host can be reached from this machine only."""
    return host == "localhost" or _is_loopback(host)


def own_names(host: str) -> frozenset[str]:
    """Names that a request may use, in addition to addresses, if a server is bound to a host."""
    if is_local(host):
        return frozenset({"localhost"})
    own = {"localhost", host.lower(), socket.gethostname().lower(), f"{socket.gethostname().lower()}.local"}
    return frozenset(own)


def is_allowed(header: str, host: str, names: frozenset[str]) -> bool:
    """True if the Host header of a request names this server.

    Parameters
    ----------
    header : str
    host : str
        Host name or address that the server is bound to.
    names : frozenset of str
        Names returned by `own_names`.
    """
    found = _HOST.fullmatch(header)
    if found is None:
        return False
    asked = (found["six"] or found["name"]).lower()
    if asked in names:
        return True
    return _is_loopback(asked) if is_local(host) else _is_address(asked)


def _is_address(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True


def _is_loopback(text: str) -> bool:
    return _is_address(text) and ipaddress.ip_address(text).is_loopback
