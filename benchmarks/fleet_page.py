"""The page of a fleet in headless Chromium: its size, and the times and memory that it takes."""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "test"))
from made_up_fleet import NOW_NS, random_fleet

from leg_wear_monitor.report.fleet_page import fleet_page
from leg_wear_monitor.report.fleet_standing import Day
from leg_wear_monitor.report.page import page_html

# The time until the layout is up to date: the browser then only has to paint.
TIMED = """
((act) => { const begin = performance.now(); act(); document.body.getBoundingClientRect();
return performance.now() - begin; })
"""
TYPED = """(word) => { const field = document.querySelector("input[type=search]"); field.value = word;
field.dispatchEvent(new Event("input")); }"""
WORDS = ("l", "leg", "leg-0", "leg-05", "leg-050", "leg-0500", "", "stop", "2026-0", "G", "")


class Browser:
    """Chromium, driven through its pipe of the DevTools protocol."""

    def __init__(self, profile: Path) -> None:
        name = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
        if name is None:
            raise SystemExit("no chromium here: apt install chromium")
        reads, self._out = os.pipe()
        self._in, writes = os.pipe()
        line = [name, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
        line += [f"--user-data-dir={profile}", "--remote-debugging-pipe", "--window-size=1200,1000"]
        shell = f'exec "$@" 3<&{reads} 4>&{writes} 2>/dev/null'
        self.process = subprocess.Popen(["bash", "-c", shell, "bash", *line], pass_fds=(reads, writes))
        os.close(reads)
        os.close(writes)
        self._rest, self._last = b"", 0

    def call(self, method: str, session: str | None = None, **parameters):
        """Result of a command."""
        self._last += 1
        message = {"id": self._last, "method": method, "params": parameters}
        os.write(
            self._out, json.dumps(message | ({"sessionId": session} if session else {})).encode() + b"\0"
        )
        while True:
            answer = self._next()
            if answer.get("id") == self._last:
                if "error" in answer:
                    raise RuntimeError(answer["error"])
                return answer["result"]

    def _next(self):
        while b"\0" not in self._rest:
            self._rest += os.read(self._in, 1 << 16)
        message, self._rest = self._rest.split(b"\0", 1)
        return json.loads(message)

    def value(self, session: str, text: str):
        """Value of an expression in the page."""
        result = self.call("Runtime.evaluate", session, expression=text, returnByValue=True)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"])
        return result["result"]["value"]


def measure(browser: Browser, address: str) -> dict[str, float]:
    """One load of the page in a tab of its own."""
    target = browser.call("Target.createTarget", url=address)["targetId"]
    session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
    entry = "performance.getEntriesByType('navigation')[0].loadEventEnd"
    while not browser.value(session, entry):
        time.sleep(0.05)
    browser.call(
        "Performance.enable", session, timeDomain="threadTicks"
    )  # of the page's thread, not of the wall
    found = {"load ms": browser.value(session, entry)}
    before = _metrics(browser, session)
    search = [browser.value(session, f"({TIMED})(() => ({TYPED})({json.dumps(word)}))") for word in WORDS]
    after = _metrics(browser, session)
    for name in ("Task", "Script", "Layout", "RecalcStyle"):
        spent = after[f"{name}Duration"] - before[f"{name}Duration"]
        found[f"search {name} CPU ms, mean"] = 1e3 * spent / len(WORDS)
    title = "document.querySelectorAll('.legs thead button')[3].click()"
    sort = [browser.value(session, f"({TIMED})(() => {title})") for _ in range(4)]
    found |= {"search ms, median": statistics.median(search), "search ms, most": max(search)}
    found |= {"sort ms, most": max(sort)}
    browser.call("HeapProfiler.collectGarbage", session)
    values = _metrics(browser, session)
    found |= {"heap MB": values["JSHeapUsedSize"] / 1e6, "nodes": values["Nodes"]}
    browser.call("Target.closeTarget", targetId=target)
    return found


def _metrics(browser: Browser, session: str) -> dict[str, float]:
    metrics = browser.call("Performance.getMetrics", session)["metrics"]
    return {each["name"]: each["value"] for each in metrics}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--legs", type=int, default=1000)
    parser.add_argument("--loads", type=int, default=5)
    parser.add_argument("--keep", type=Path, help="file to keep the page in")
    options = parser.parse_args()
    fleet = random_fleet(options.legs)
    begin = time.process_time()
    page = fleet_page(fleet, Day(now_ns=NOW_NS, fresh_days=7.0), {leg.id for leg in fleet.legs})
    html = page_html(page).encode()
    print(f"legs: {options.legs}\nmade in: {time.process_time() - begin:.2f} s CPU\nbytes: {len(html)}")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as directory:
        file = options.keep or Path(directory) / "report.html"
        file.write_bytes(html)
        browser = Browser(Path(directory) / "profile")
        loads = [measure(browser, file.absolute().as_uri()) for _ in range(options.loads)]
        browser.call("Browser.close")
        browser.process.wait(timeout=30)
    for name in loads[0]:
        values = [each[name] for each in loads]
        ends = f"{min(values):.1f} to {max(values):.1f}"
        print(f"{name}: {statistics.median(values):.1f} (of {len(values)}: {ends})")


if __name__ == "__main__":
    main()
