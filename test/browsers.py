# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""An installed Chromium, driven by playwright: pages that ask nobody and complain of nothing."""

import io
import shutil
import time
from contextlib import contextmanager

import numpy as np
import pytest

CHROMIUM = next(filter(None, map(shutil.which, (
    'chromium', 'chromium-browser', 'google-chrome'))), None)
SCREENS = [(1280, 800), (390, 844)]


@contextmanager
def launched():
    """Give a browser, until the block ends."""
    from playwright.sync_api import sync_playwright
    with sync_playwright() as driver:
        # No graphics hardware: WebGL is drawn by the processor.
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=[
            '--no-sandbox', '--disable-gpu', '--enable-unsafe-swiftshader',
            '--disable-background-networking'])
        yield browser
        browser.close()


def chromium():
    """Yield a browser; skip where there is none."""
    pytest.importorskip('playwright.sync_api', reason='needs playwright')
    if CHROMIUM is None:
        pytest.skip('no Chromium is installed')
    with launched() as browser:
        yield browser


class Tab:
    """
    A page in a window of a size; at the end it asked only its own address and erred nowhere.

    ends : its server does, and that it does not answer then is no error.
    """

    def __init__(self, browser, url, size, *, ends=False):
        width, height = size
        self._context = browser.new_context(
            viewport={'width': width, 'height': height}, is_mobile=width < 700,
            has_touch=width < 700)
        self.page = self._context.new_page()
        self._asked, self._wrong = [], []
        self._own = url.partition('#')[0]
        self.page.on('request', lambda request: self._asked.append(request.url))
        self.page.on('pageerror', lambda error: self._wrong.append(str(error)))
        self.page.on('console', lambda said: self._wrong.append(said.text)
                     if said.type == 'error' and not (
                         ends and 'ERR_CONNECTION_REFUSED' in said.text) else None)
        self.page.goto(url)

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        self._context.close()
        assert self._wrong == []
        if kind is None:
            own = self._own, 'data:', f'blob:{self._own}', self._own.replace('http', 'ws')
            assert self._asked and all(url.startswith(own) for url in self._asked), self._asked

    def until(self, expression):
        """Wait for an expression; playwright's own way evaluates text, which pages forbid."""
        end = time.monotonic() + 30.0
        while not (found := self.page.evaluate(expression)):
            assert time.monotonic() < end, expression
            self.page.wait_for_timeout(50)
        return found

    def inked(self, selector):
        """Return how many points of an element are not nearly white."""
        image = pytest.importorskip('matplotlib.image', reason='reads the screenshots')
        shot = image.imread(io.BytesIO(self.page.locator(selector).screenshot()), format='png')
        return np.count_nonzero(shot[..., :3].min(axis=-1) < 0.8)
