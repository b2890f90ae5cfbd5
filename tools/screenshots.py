# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The pictures of the report and of the live page, as Chromium shows them.

By what the tests of these pages open them with: an installed Chromium through playwright, and
nodes in a domain of their own.
"""

import importlib.util
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

SIZE = (1280, 800)
CRUISE = 5.0
"""What the histories show of flight before the stall [s]."""
PULLED = -12.0
"""The elevator that the live page stalls with [deg]."""
STALLED = 90
"""How much of the wing stalls when its picture is taken [%]."""


class Missing(RuntimeError):
    """What a picture needs is not here; the text says what."""


def need(*modules: str, extra: str) -> None:
    """Raise `Missing` for modules that are not installed; extra : which brings them."""
    if gone := [name for name in modules if importlib.util.find_spec(name) is None]:
        raise Missing(f"needs {', '.join(gone)}: pip install '.[{extra}]' in the checkout")


@contextmanager
def _browser() -> Iterator[Any]:
    """Give Chromium, until the block ends."""
    need('playwright', extra='browser')
    import browsers
    if browsers.CHROMIUM is None:
        raise Missing('needs Chromium, and none is on the PATH')
    with browsers.launched() as browser:
        yield browser


def of_report(report: Path, file: Path, size: tuple[int, int] = SIZE) -> None:
    """Draw the first screen of a report, which opens in the deepest stall."""
    with _browser() as browser:
        import browsers
        with browsers.Tab(browser, report.resolve().as_uri(), size) as tab:
            tab.until('document.getElementById("readouts").textContent !== ""')
            tab.until('document.querySelectorAll("#view canvas").length > 0')
            tab.page.wait_for_timeout(2000)   # until the scene has been drawn
            tab.page.screenshot(path=str(file))


def of_live_page(file: Path, size: tuple[int, int] = SIZE) -> None:
    """Draw the live page as it pulls the trainer into the stall."""
    need('rclpy', extra='ros')
    need('aiohttp', extra='watch')
    with _browser() as browser, tempfile.TemporaryDirectory() as folder:
        import browsers
        import processes
        import watching
        with closing(processes.starter(Path(folder))) as nodes:
            start = next(nodes)
            start('simulator')
            url = watching.address(start(watching.SCRIPT, '--port', '0', '--control'))
            with browsers.Tab(browser, url, size) as tab:
                _stall(tab)
                tab.page.screenshot(path=str(file))


def _stall(tab: Any) -> None:
    """Take the controls of a live page and pull until the wing is stalled."""
    elevator = 'document.getElementById("control-elevator")'
    tab.until('document.getElementById("link").textContent === "flying"')
    tab.until(f'document.querySelectorAll("#view canvas").length > 0 && {elevator}')
    tab.page.wait_for_timeout(1e3 * CRUISE)
    tab.page.click('#take')
    tab.until(f'!{elevator}.disabled')
    while tab.page.evaluate(f'Number({elevator}.value)') > PULLED:
        tab.page.keyboard.press('ArrowDown')
        tab.page.wait_for_timeout(100)
    tab.until('parseFloat(document.querySelector("[data-gauge=stalled] dd").textContent) '
              f'>= {STALLED}')
