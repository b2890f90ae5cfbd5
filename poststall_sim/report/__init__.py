# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A flight or a polar as one HTML page that needs nothing else, to be looked at in any browser.

`flight` and `polar` put together what the page shows, as plain data; `page` makes the file of it;
page.html and page.js are what the browser gets, and figures.js, which the live page shares.
"""
