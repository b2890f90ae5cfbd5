# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""`poststall watch` as a process, and a page of it without a browser."""

import asyncio
import json
import sys
import time
from pathlib import Path
from urllib.parse import urlsplit

from processes import LIMIT

SCRIPT = Path(__file__)


class Page:
    """A connection as the page's script makes it; its parts as they were last sent."""

    def __init__(self, url, **headers):
        import aiohttp

        self._aiohttp = aiohttp
        self._loop = asyncio.new_event_loop()
        found = urlsplit(url)
        self.address = f'{found.scheme}://{found.netloc}'
        self._headers = {'Origin': self.address, **headers}
        self._session = self._run(self._begin())
        self.key = found.fragment
        self._socket = None
        self.parts = {}
        self.goodbye = None

    async def _begin(self):
        return self._aiohttp.ClientSession()

    def _run(self, what):
        return self._loop.run_until_complete(asyncio.wait_for(what, LIMIT))

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
        return 101

    def send(self, order):
        """Send an order, or a text or bytes as they are."""
        self._run(self._socket.send_bytes(order) if isinstance(order, bytes) else
                  self._socket.send_str(order if isinstance(order, str) else json.dumps(order)))

    def hear(self):
        """Take the next part; false once the connection has been closed, with which words."""
        message = self._run(self._socket.receive())
        if message.type is not self._aiohttp.WSMsgType.TEXT:
            self.goodbye = message.extra
            return False
        part = json.loads(message.data)
        self.parts[part['kind']] = part
        return True

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
        self._loop.close()


def address(process):
    """Return the address of the page that a process of `SCRIPT` says it serves."""
    process.wait_for('Ctrl-C ends it')
    return process.says().split()[0]


if __name__ == '__main__':
    from poststall_sim import cli

    sys.exit(cli.main(['watch', *sys.argv[1:]]))
