"""Pages in headless Chromium, in frames of two widths, which a script tries."""

import html
import json
import re
import shutil
import subprocess

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

NEEDS_CHROMIUM = pytest.mark.skipif(
    CHROMIUM is None, reason="no chromium here: apt install chromium runs these tests"
)

WIDTHS = (1200, 390)


_LINE = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]


def printed(page, directory):
    """Number of sheets that a page is printed on."""
    (directory / "page.html").write_text(page)
    line = [*_LINE, f"--user-data-dir={directory / 'profile'}", "--virtual-time-budget=5000"]
    line += [f"--print-to-pdf={directory / 'page.pdf'}", (directory / "page.html").as_uri()]
    subprocess.run(line, capture_output=True, timeout=240, check=True)
    return max(map(int, re.findall(rb"/Count (\d+)", (directory / "page.pdf").read_bytes())))


def browse(pages, directory, script):
    """What a script finds in each page at each width, and the lines on the browser's console.

    The script leaves its findings as JSON in the element ``found``, a list with an entry a frame.
    """
    frames = "".join(
        f'<iframe style="width:{width}px;height:900px;border:0" srcdoc="{html.escape(page)}"></iframe>'
        for page in pages
        for width in WIDTHS
    )
    wrapper = directory / "wrapper.html"
    text = f'<!doctype html><meta charset="utf-8"><script>{script}</script>{frames}<pre id="found"></pre>'
    wrapper.write_text(text)
    line = [*_LINE, f"--user-data-dir={directory / 'profile'}", "--enable-logging=stderr"]
    line += ["--window-size=1300,1000", "--virtual-time-budget=10000", "--dump-dom", wrapper.as_uri()]
    done = subprocess.run(line, capture_output=True, text=True, timeout=240, check=True)
    found = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL).group(1)
    lines = done.stderr.splitlines()  # the browser's own pages write to its console as well
    console = [said for said in lines if "CONSOLE" in said and "source: chrome://" not in said]
    return json.loads(html.unescape(found)), console
