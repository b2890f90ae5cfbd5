# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The server of the live page: on the loopback only, for pages that it served itself.

A browser runs pages of strangers beside ours, and they too reach the loopback. So a request is
answered only under a name of the loopback (else a stranger's name could be pointed here), a
connection only to a page of this server's own origin, and orders are taken only from a page that
was opened with the key.
"""

import asyncio
import errno
import hmac
import json
import secrets
import signal
import time
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import Future
from html import escape
from importlib import resources
from string import Template
from typing import Protocol

from aiohttp import WSCloseCode, WSMsgType, web

from poststall_sim import __version__, report
from poststall_sim.report.page import COLOURS
from poststall_sim.watch import orders
from poststall_sim.watch.orders import Act, Fly, Release
from poststall_sim.watch.scene import Data, Scene
from poststall_sim.watch.stick import Stick

LOOPBACK = '127.0.0.1'
COMMAND_PERIOD = 0.05
"""So often the controls that a page holds are commanded [s]."""
MOST_PAGES = 16
"""Pages that are served at one time."""
GOODBYE = 0.5
"""So long may it take to close the pages at the end [s]."""
REASON = 123
"""What a closed connection may say of why it was, at most [bytes]; so the protocol has it."""

_HEADERS = {
    'X-Content-Type-Options': 'nosniff', 'Referrer-Policy': 'no-referrer',
    'Cross-Origin-Resource-Policy': 'same-origin', 'Cache-Control': 'no-store'}


class Simulator(Protocol):
    """What the server asks of whoever talks to the simulator."""

    scene: Scene

    def command(self, values: Mapping[str, float]) -> None:
        """Command controls by name [rad; throttle 0..1]."""

    def act(self, action: str, answered: Callable[[bool, str], None]) -> None:
        """Ask for one of `orders.ACTIONS`; the answer may come on another thread."""


class Server:
    """
    The page, and a connection for each browser that shows it.

    control : whether pages may fly; rate : how often they get the state [Hz].
    """

    def __init__(self, simulator: Simulator, *, control: bool, rate: float) -> None:
        self._simulator = simulator
        self._rate = rate
        self._key = secrets.token_urlsafe(16) if control else None
        self._stick = Stick()
        self._pages: set[web.WebSocketResponse] = set()
        self._files = _files()
        self._port = 0
        self._goodbye = WSCloseCode.GOING_AWAY, b''
        self._end: asyncio.Future[None]

    @property
    def url(self) -> str:
        """The address of the page, with the key where there is one."""
        return f'http://{LOOPBACK}:{self._port}/' + (f'#{self._key}' if self._key else '')

    async def serve(self, port: int, ready: Callable[[str], None],
                    listening: Future[None]) -> None:
        """
        Serve until SIGINT or SIGTERM; ready : told the address once the page can be had.

        An exception in what serves the pages, or in ``listening``, whoever puts into the scene
        what he hears, ends it too: what the pages show from then on would be of the past, and
        nobody would know. They are told why.

        Raises
        ------
        OSError
            When the port cannot be had.
        RuntimeError
            From the exception that ended it.

        """
        app = web.Application(middlewares=[self._guard])
        app.router.add_get('/live', self._live)
        for path in self._files:
            app.router.add_get(path, self._file)
        app.on_shutdown.append(self._close)
        runner = web.AppRunner(app, access_log=None, shutdown_timeout=GOODBYE)
        await runner.setup()
        try:
            self._port = await _listen(runner, port)
            loop = asyncio.get_running_loop()
            self._end = loop.create_future()
            for number in (signal.SIGINT, signal.SIGTERM):
                loop.add_signal_handler(number, self._stop)
            ready(self.url)
            needed = asyncio.create_task(self._fly()), asyncio.wrap_future(listening)
            try:
                for work in needed:
                    work.add_done_callback(self._judge)
                await self._end
            except Exception as error:
                self._goodbye = WSCloseCode.INTERNAL_ERROR, _reason(error)
                raise RuntimeError('the live page has stopped') from error
            finally:
                for work in needed:
                    work.cancel()
        finally:
            await runner.cleanup()

    def _stop(self, error: BaseException | None = None) -> None:
        """End serving, for an exception if one is given."""
        if self._end.done():
            return
        if error is None:
            self._end.set_result(None)
        else:
            self._end.set_exception(error)

    def _judge(self, work: asyncio.Future) -> None:
        """End serving if an exception has ended what it cannot do without."""
        if not work.cancelled() and (error := work.exception()) is not None:
            self._stop(error)

    @web.middleware
    async def _guard(self, request: web.Request, handler: Callable[
            [web.Request], Awaitable[web.StreamResponse]]) -> web.StreamResponse:
        """Answer only those who ask for a name of the loopback, and say what a page may do."""
        if request.headers.get('Host') not in self._hosts:
            raise web.HTTPForbidden(text='this page is for this machine only')
        response = await handler(request)
        if not response.prepared:
            response.headers.update(_HEADERS)
            sockets = ' '.join(f'ws://{host}' for host in self._hosts)
            # The plotting library writes styles of its own.
            response.headers['Content-Security-Policy'] = (
                "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
                f"img-src data: blob:; connect-src {sockets}; base-uri 'none'; "
                "form-action 'none'; frame-ancestors 'none'")
        return response

    @property
    def _hosts(self) -> tuple[str, ...]:
        return f'{LOOPBACK}:{self._port}', f'localhost:{self._port}'

    async def _file(self, request: web.Request) -> web.Response:
        text, kind = self._files[request.path]
        return web.Response(body=text, content_type=kind, charset='utf-8')

    async def _live(self, request: web.Request) -> web.WebSocketResponse:
        """Show the flight to one page, and take its orders if it has the key."""
        if request.headers.get('Origin') not in [f'http://{host}' for host in self._hosts]:
            raise web.HTTPForbidden(text='not a page of this server')
        key = request.query.get('key')
        if key is not None and not (self._key and hmac.compare_digest(
                key.encode(), self._key.encode())):
            raise web.HTTPForbidden(text='not the key of this server')
        if len(self._pages) >= MOST_PAGES:
            raise web.HTTPServiceUnavailable(text=f'{MOST_PAGES} pages are open already')
        page = web.WebSocketResponse(
            heartbeat=10.0, max_msg_size=orders.LONGEST, compress=False)
        await page.prepare(request)
        self._pages.add(page)
        showing = asyncio.create_task(self._show(page, may_fly=key is not None))
        showing.add_done_callback(self._judge)
        try:
            async for message in page:
                if message.type is WSMsgType.TEXT and key is not None:
                    await self._obey(page, message.data)
        finally:
            self._pages.discard(page)
            self._stick.release(page)
            showing.cancel()
        return page

    async def _show(self, page: web.WebSocketResponse, *, may_fly: bool) -> None:
        """Send what has changed since it was last sent, as fast as the page takes it."""
        sent: dict[str, object] = {}
        try:
            while True:
                begin = time.monotonic()
                held = {'may': may_fly, 'mine': self._stick.holder is page,
                        'taken': self._stick.holder is not None}
                for kind, (number, part) in [
                        *self._simulator.scene.parts().items(), ('stick', (held, held))]:
                    if sent.get(kind) != number:
                        sent[kind] = number
                        await page.send_str(_text(kind, part))
                await asyncio.sleep(max(1.0 / self._rate - (time.monotonic() - begin), 0.001))
        except ConnectionError:   # the page has gone: who reads from it ends this
            return

    async def _obey(self, page: web.WebSocketResponse, text: str) -> None:
        """Do what a page asks for, or say why not."""
        try:
            order = orders.read(text, self._simulator.scene.limits)
        except orders.Refused as error:
            await page.send_str(_text('answer', {'done': False, 'text': f'refused: {error}'}))
            return
        match order:
            case Fly(values, take):
                self._stick.hold(page, values, time.monotonic(), take=take)
            case Release():
                self._stick.release(page)
            case Act(action):
                self._act(page, action)

    def _act(self, page: web.WebSocketResponse, action: str) -> None:
        loop = asyncio.get_running_loop()

        async def tell(done: bool, text: str) -> None:
            if not page.closed:
                await page.send_str(_text('answer', {'done': done, 'text': f'{action}: {text}'}))

        def answered(done: bool, text: str) -> None:
            if not loop.is_closed():
                asyncio.run_coroutine_threadsafe(tell(done, text), loop)

        self._simulator.act(action, answered)

    async def _fly(self) -> None:
        """Command what the page that holds the controls holds them at."""
        while True:
            if values := self._stick.values(time.monotonic()):
                self._simulator.command(values)
            await asyncio.sleep(COMMAND_PERIOD)

    async def _close(self, app: web.Application) -> None:
        """Say goodbye to the pages; one that does not read keeps nobody waiting."""
        code, message = self._goodbye
        closing = [asyncio.ensure_future(page.close(code=code, message=message))
                   for page in self._pages]
        if closing:
            _, waiting = await asyncio.wait(closing, timeout=GOODBYE)
            for each in waiting:
                each.cancel()


def _text(kind: str, part: Data) -> str:
    return json.dumps({'kind': kind, **part}, allow_nan=False, separators=(',', ':'))


def _reason(error: BaseException) -> bytes:
    """Return an exception as what a closed connection says, cut where that has to end."""
    text = f'{type(error).__name__}: {error}'.encode(errors='replace')
    return text[:REASON].decode(errors='ignore').encode()


async def _listen(runner: web.AppRunner, port: int) -> int:
    """Listen on a port of the loopback, 0 for any that is free; return which."""
    try:
        await web.TCPSite(runner, LOOPBACK, port).start()
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise OSError(f'port {port} is in use: choose another with --port, or 0 for any '
                          'that is free') from None
        raise
    return runner.addresses[0][1]


def _files() -> dict[str, tuple[bytes, str]]:
    """
    Return all that can be had, by path: contents and content type.

    Raises
    ------
    ImportError
        When there is no plotly, with what to do about it.

    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise ImportError('the live page needs plotly: pip install plotly') from error
    own, shared = resources.files(__package__), resources.files(report)
    page = Template((own / 'live.html').read_text(encoding='utf-8')).substitute(
        version=escape(__version__), colours=escape(json.dumps(COLOURS)))
    script = 'text/javascript'
    return {'/': (page.encode(), 'text/html'),
            '/figures.js': ((shared / 'figures.js').read_bytes(), script),
            **{f'/{name}': ((own / name).read_bytes(), script)
               for name in ('aircraft.js', 'live.js')},
            '/live.css': ((own / 'live.css').read_bytes(), 'text/css'),
            '/plotly.js': (get_plotlyjs().encode(), script)}
