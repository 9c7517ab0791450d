"""How Sphinx builds docs/ into a site (`make docs`): MyST Markdown, notebooks that run, reference pages from code."""

import posixpath
import sys
from pathlib import Path

from sphinx.addnodes import download_reference

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE)]

import _generate  # noqa: E402

import birthsim_env  # noqa: E402

project = "BirthSIM"
author = "The BirthSIM developers"
copyright = author
version = release = birthsim_env.__version__

extensions = ["myst_nb"]
exclude_patterns = ["_generate"]
toc_object_entries = False
# Indented and unnamed blocks hold commands, formulas and TOML; what is Python says so.
highlight_language = "none"
# Two hyphens begin an option.
smartquotes = False

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4

# Every notebook runs at every build, in a folder of its own, and a failing cell fails the build.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True
# Progress bars, and the word that kernels compile.
nb_output_stderr = "remove"

html_theme = "furo"
html_title = "BirthSIM"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["tables.js", "data.js"]
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
templates_path = []

linkcheck_timeout = 20
linkcheck_retries = 2


def seen_from_the_site(app, page, source):
    """Links to the README lead to its page of the site."""
    up = "../" * page.count("/")
    source[0] = source[0].replace(f"]({up}../README.md", f"]({up}project/readme.md")


def with_data(app, page, template, context, doctree):
    """Put each data file that a page links into the page, where data.js finds it: a page opened from a disk can fetch none."""
    for link in doctree.findall(download_reference) if doctree else ():
        file = HERE / posixpath.dirname(page) / link["reftarget"]
        if file.suffix == ".csv":
            app.add_js_file(None, body=file.read_text(encoding="utf-8"), type="text/csv", title=file.name)


def setup(app):
    """Write the generated parts before any page is read."""
    app.connect("source-read", seen_from_the_site)
    app.connect("html-page-context", with_data)
    app.connect("builder-inited", lambda _: _generate.write(HERE.parent / "out" / "docs-generated"))
    return {"parallel_read_safe": False}
