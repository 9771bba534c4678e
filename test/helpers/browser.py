# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium that can reach this computer only, and reads Bokeh's page."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--window-size=1400,1250",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1, EXCLUDE localhost",
)  # fmt: skip

# Bokeh draws into nested shadow roots, which a plain query does not enter.
_FIND = """
const wanted = arguments[0], kind = arguments[1];
function* walk(root) {
  for (const e of root.querySelectorAll('*')) { yield e; if (e.shadowRoot) yield* walk(e.shadowRoot); }
}
for (const e of walk(document)) { if (e.matches(kind) && (!wanted || e.textContent.trim() === wanted)) return e; }
return null;
"""
_MODEL = (
    "const d = Bokeh.documents[0]; const m = d && d.get_model_by_name(arguments[0]); return m ? m[arguments[1]] : null;"
)
_DRAWN = """
const sizes = [];
function walk(root) {
  for (const e of root.querySelectorAll('*')) {
    if (e.tagName === 'CANVAS' && e.width > 100) sizes.push(e.toDataURL().length);
    if (e.shadowRoot) walk(e.shadowRoot);
  }
}
walk(document); return sizes;
"""


class Browser:
    """One tab."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def open(self, url: str) -> None:
        """Load the page and wait until Bokeh has built it."""
        self.driver.get(url)
        self.wait(lambda: self.model("status", "text"), "the page to build itself")

    def wait(self, condition: Callable[[], Any], what: str, seconds: float = 40.0) -> Any:
        """Until ``condition`` gives something true; fails with ``what`` otherwise."""
        end = time.monotonic() + seconds
        last: object = None
        while time.monotonic() < end:
            try:
                found = condition()
            except Exception as error:  # the page may still be building itself
                found = None
                last = error
            if found:
                return found
            time.sleep(0.1)
        errors = [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"]
        raise AssertionError(f"waited {seconds} s for {what}; last: {last!r}; the browser says {errors[-3:]}")

    def model(self, name: str, key: str) -> Any:
        """A property of a named Bokeh model as the page has it."""
        return self.driver.execute_script(_MODEL, name, key)

    def click(self, text: str) -> None:
        """Press the button with this label."""
        button = self.driver.execute_script(_FIND, text, "button")
        assert button is not None, f"no button {text!r}"
        button.click()

    def drawn(self) -> list[int]:
        """Sizes of the compressed pictures of all canvases: blank ones are small."""
        return list(self.driver.execute_script(_DRAWN))


@contextmanager
def browser() -> Iterator[Browser]:
    """Skips with a clear word where Chromium or its driver is not installed."""
    webdriver = pytest.importorskip("selenium.webdriver")
    from selenium.webdriver.chrome.service import Service

    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        pytest.skip("needs chromium and chromedriver (Debian: chromium, chromium-driver)")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in FLAGS:
        options.add_argument(flag)
    made = webdriver.Chrome(options=options, service=Service(driver))
    try:
        yield Browser(made)
    finally:
        made.quit()
