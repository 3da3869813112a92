"""A real Chromium: the system's, or the one that VEDETTE_BROWSER names, where the tests must not be skipped."""

import os
import shutil
from contextlib import contextmanager
from importlib.util import find_spec
from time import monotonic

PROMISED = os.environ.get("VEDETTE_BROWSER")
PATH = PROMISED or shutil.which("chromium") or shutil.which("google-chrome")
LACKING = (
    None if PROMISED or (PATH and find_spec("playwright")) else "needs Chromium and playwright, which are not installed"
)
FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)


@contextmanager
def browser():
    """A browser without a screen."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=PATH, args=list(FLAGS))
        try:
            yield running
        finally:
            running.close()


class Opened:
    """A page in a window of a size, with what it said on the console and what it asked for."""

    def __init__(self, running, path, width=1400, height=900, scheme="light"):
        self.tab = running.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
        self.tab.set_default_timeout(30_000)  # of a machine with other things to do
        self.said, self.asked = [], []
        self.tab.on("console", lambda message: self.said.append(message.text))
        self.tab.on("pageerror", lambda error: self.said.append(str(error)))
        self.tab.on("request", lambda request: self.asked.append(request.url))
        self.tab.goto(path.as_uri())
        self.wait("Boolean(document.documentElement.dataset.ready)", seconds=60)

    def wait(self, condition, seconds=20):
        """Wait until something holds on the page, whose policy forbids the browser's own way of waiting."""
        end = monotonic() + seconds
        while not self.tab.evaluate(condition):
            assert monotonic() < end, f"it never came true: {condition}; the console: {self.said}"
            self.tab.wait_for_timeout(20)

    def values(self):
        """The text of each value that is told of the scan, the track or the return."""
        cells = "[...document.querySelectorAll('[data-value]')].map((cell) => [cell.dataset.value, cell.textContent])"
        return dict(self.tab.evaluate(cells))
