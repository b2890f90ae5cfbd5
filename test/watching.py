# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""`poststall watch` as a process, and a page of it without a browser."""

import asyncio
import json
import queue
import re
import sys
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

from processes import LIMIT

SCRIPT = Path(__file__)


class Page:
    """
    A connection as the page's script makes it; its parts as they were last sent.

    It lives in a thread of its own: the server lets go of who does not answer its pings, as a
    test does not while it waits for something else.
    """

    def __init__(self, url, **headers):
        import aiohttp

        self._aiohttp = aiohttp
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        found = urlsplit(url)
        self.address = f'{found.scheme}://{found.netloc}'
        self._headers = {'Origin': self.address, **headers}
        self._session = self._run(self._begin())
        self.key = found.fragment
        self._socket = None
        self._heard = queue.SimpleQueue()
        self.parts = {}
        self.goodbye = None

    async def _begin(self):
        return self._aiohttp.ClientSession()

    def _run(self, what):
        return asyncio.run_coroutine_threadsafe(
            asyncio.wait_for(what, LIMIT), self._loop).result()

    def get(self, path, **headers):
        """Return status, headers and body of a file."""
        async def get():
            async with self._session.get(self.address + path, headers=headers) as answer:
                return answer.status, answer.headers, await answer.text()
        return self._run(get())

    def connect(self, key=None):
        """Connect, by the key of the address unless told otherwise; return the status."""
        key = self.key if key is None else key
        url = self.address.replace('http', 'ws') + '/live' + (f'?key={key}' if key else '')
        try:
            self._socket = self._run(self._session.ws_connect(url, headers=self._headers))
        except self._aiohttp.WSServerHandshakeError as error:
            return error.status
        asyncio.run_coroutine_threadsafe(self._listen(), self._loop)
        return 101

    async def _listen(self):
        try:
            while (message := await self._socket.receive()).type is self._aiohttp.WSMsgType.TEXT:
                self._heard.put(message.data)
            self.goodbye = message.extra
        finally:
            self._heard.put(None)

    def send(self, order):
        """Send an order, or a text or bytes as they are."""
        self._run(self._socket.send_bytes(order) if isinstance(order, bytes) else
                  self._socket.send_str(order if isinstance(order, str) else json.dumps(order)))

    def hear(self):
        """Take the next part; false once the connection has been closed, with which words."""
        data = self._heard.get(timeout=LIMIT)
        if data is None:
            self._heard.put(None)   # so it stays
            return False
        part = json.loads(data)
        self.parts[part['kind']] = part
        return True

    def catch_up(self):
        """Take the next part, and all others that have come."""
        while self.hear() and not self._heard.empty():
            pass

    def until(self, done, what='that'):
        """Take parts until ``done`` gives something true of them, and return it."""
        end = time.monotonic() + LIMIT
        while not (result := done(self.parts)):
            assert time.monotonic() < end, f'waited {LIMIT:g} s for {what}: {self.parts}'
            assert self.hear(), f'closed before {what}'
        return result

    def ask(self, order):
        """Send an order and return the answer."""
        self.parts.pop('answer', None)
        self.send(order)
        return self.until(lambda parts: parts.get('answer'), f'an answer to {order}')

    def close(self):
        if self._loop.is_closed():
            return
        if self._socket is not None:
            self._run(self._socket.close())
        self._run(self._session.close())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


def address(process):
    """Return the address of the page that a process of `SCRIPT` says it serves."""
    process.wait_for('Ctrl-C ends it')
    return re.search(r'http://\S+', process.says())[0]   # the middleware may have said something


if __name__ == '__main__':
    from poststall_sim import cli

    sys.exit(cli.main(['watch', *sys.argv[1:]]))
