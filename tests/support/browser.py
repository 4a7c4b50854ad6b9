"""A browser for tests of pages: the system's Chromium, driven by Playwright. Tests skip where one of them is not."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@contextmanager
def browser() -> Iterator[Any]:
    """Chromium, without a window. Skips the test where there is none."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: pip install -e '.[browser]'")
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        pytest.skip("there is no Chromium here: apt-get install chromium")
    with api.sync_playwright() as play:
        try:
            chromium = play.chromium.launch(executable_path=program, args=["--no-sandbox"])
        except api.Error as error:
            pytest.skip(f"Chromium does not start: {str(error).splitlines()[0]}")
        yield chromium
        chromium.close()


class Watched:
    """A page that is opened, and all that went wrong: lines of the console, and requests that left the file."""

    def __init__(self, page: Any, file: Path) -> None:
        self.page, self.wrong, self.requests = page, [], []  # type: ignore[var-annotated]
        page.on("console", lambda message: self.wrong.append(message.text) if message.type != "log" else None)
        page.on("pageerror", lambda error: self.wrong.append(str(error)))
        page.on("request", lambda request: self._note(request.url))
        page.goto(file.absolute().as_uri())

    def _note(self, url: str) -> None:
        is_page = url.startswith("file:") and url.partition("#")[0].endswith(".html")
        if not is_page and not url.startswith("data:"):
            self.requests.append(url)
