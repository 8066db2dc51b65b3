"""A page in headless Chromium that goes on while a test looks at it, over its developer tools' protocol."""

import asyncio
import json
import subprocess
import time
import urllib.request

from browser import CHROMIUM

PATIENCE_S = 120.0
_AGAIN_S = 0.05


class LivePage:
    """One page.

    Attributes
    ----------
    console : list of str
        What was written to the console, exceptions that nobody caught, and what the browser refused.
    """

    def __init__(self, address, directory, width=1200, height=1500):
        self.console = []
        self._loop = asyncio.new_event_loop()
        self._number = 0
        line = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
        line += ["--disable-background-networking", "--no-first-run", "--hide-scrollbars"]
        line += [f"--user-data-dir={directory / 'profile'}", "--remote-debugging-port=0", "about:blank"]
        self._browser = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            self._connect(directory / "profile" / "DevToolsActivePort")
            for domain in ("Page", "Runtime", "Log"):
                self.command(f"{domain}.enable")
            self.resize(width, height)
            self.command("Page.navigate", url=address)
        except BaseException:
            self.close()
            raise

    def _connect(self, port_file):
        wait_for(port_file.exists, "the browser")
        port = wait_for(lambda: port_file.read_text().split("\n")[0], "the port of the browser")
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=30) as answer:
            pages = json.load(answer)
        address = next(page["webSocketDebuggerUrl"] for page in pages if page["type"] == "page")
        self._socket = self._loop.run_until_complete(_connected(address))

    def command(self, method, **parameters):
        """The answer to a command; events that come before it go to the console."""
        answer = asyncio.wait_for(self._answer(method, parameters), PATIENCE_S)
        return self._loop.run_until_complete(answer)

    async def _answer(self, method, parameters):
        self._number += 1
        number = self._number
        await self._socket.write_message(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message = json.loads(await self._socket.read_message())
            if message.get("id") == number:
                assert "error" not in message, message
                return message["result"]
            self._note(message)

    def _note(self, event):
        if event["method"] in ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"):
            self.console.append(json.dumps(event["params"])[:500])

    def resize(self, width, height):
        """As a phone or a desk shows it."""
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
                     mobile=width < 600)  # fmt: skip

    def value(self, expression):
        """Value of an expression in the page."""
        found = self.command("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def text(self, selector):
        """Text of an element as a reader sees it; empty if there is none."""
        found = f"document.querySelector({json.dumps(selector)})"
        return self.value(f"{found} ? {found}.innerText : ''")

    def wait(self, expression, what, patience_s=PATIENCE_S):
        """Come back when an expression is true."""
        wait_for(lambda: self.value(f"Boolean({expression})"), what, patience_s)

    def close(self):
        """End the browser."""
        if hasattr(self, "_socket"):
            self._loop.run_until_complete(self._leave())
        self._loop.close()
        self._browser.kill()
        self._browser.wait()

    async def _leave(self):
        self._socket.close()
        while await self._socket.read_message() is not None:
            continue


async def _connected(address):
    from tornado.websocket import websocket_connect

    return await websocket_connect(address, max_message_size=10**8)


def wait_for(there, what, patience_s=PATIENCE_S):
    """Come back with something when it is there."""
    for _ in range(int(patience_s / _AGAIN_S)):
        if found := there():
            return found
        time.sleep(_AGAIN_S)
    raise AssertionError(f"waited in vain for {what}")
