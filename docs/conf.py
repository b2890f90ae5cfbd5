# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""How Sphinx makes the site of these pages: `make docs`."""

import os
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path[:0] = [str(HERE), str(ROOT)]
# What numba compiles is no function to Sphinx: its signature and docstring would be missing.
os.environ['NUMBA_DISABLE_JIT'] = '1'

from poststall_sim import __version__  # noqa: E402

project = 'poststall_sim'
copyright = '2026, the poststall_sim developers'
version = release = __version__

extensions = [
    'myst_parser',
    'sphinx.ext.autodoc',
    'sphinx_copybutton',
    # Brings MathJax along: the pages ask nothing of the network.
    'sphinx-mathjax-offline',
    'reference_from_code',
    'plain_docstrings',
]
smartquotes = False   # `--option` and 'a text' are what they are
exclude_patterns = ['_build']
myst_enable_extensions = ['dollarmath']
myst_heading_anchors = 3
autodoc_member_order = 'bysource'
autodoc_typehints_format = 'short'
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 99

# Hundreds of functions in each page's navigation take longer than all the rest.
toc_object_entries = False

html_theme = 'furo'
html_title = f'poststall_sim {__version__}'
html_show_sphinx = False
copybutton_prompt_text = '$ '

# A link that leaves docs/ for a folder or for a page that the site does not have.
_OUTSIDE = re.compile(r'(?<!!)\[([^\]]+)\]\(((?:\.\./)+[^)#]*)(#[^)]*)?\)')


def setup(app):
    """Let links that only a checkout can follow be plain text here."""
    def follow(app, docname, source):
        folder = HERE / Path(docname).parent

        def kept(link):
            path = (folder / link[2]).resolve()
            inside = path.is_relative_to(HERE) or (path.is_file() and path.suffix != '.md')
            return link[0] if inside else link[1]
        source[0] = _OUTSIDE.sub(kept, source[0])
    app.connect('source-read', follow)
