"""How Sphinx builds docs/ into a site (`make docs`): MyST Markdown, notebooks that run, reference pages from code."""

import os
import posixpath
import shutil
import sys
from pathlib import Path

from markupsafe import Markup, escape
from sphinx.addnodes import download_reference

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE)]

import _generate  # noqa: E402
from _generate import notebooks, stages, words  # noqa: E402
from _generate.landing import install_role, rig_role  # noqa: E402

import birthsim_env  # noqa: E402
from birthsim_live.rig.folder import packed_page, write_page  # noqa: E402

project = "BirthSIM"
author = "The BirthSIM developers"
copyright = author
version = release = birthsim_env.__version__

extensions = ["myst_nb"]
exclude_patterns = ["_generate", "data"]
toc_object_entries = False
# Indented and unnamed blocks hold commands, formulas and TOML; what is Python says so.
highlight_language = "none"
# Two hyphens begin an option.
smartquotes = False

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4

# Every notebook runs at every build, in a folder of its own, for as long as it takes: machines differ tenfold. A cell that
# fails is a warning with its notebook, source and words, which fails the build; an exception would name Sphinx's tracker.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_show_tb = True
nb_execution_timeout = -1
# A commit's tests run few (tests/project/test_docs.py).
nb_execution_excludepatterns = os.environ.get("BIRTHSIM_UNRUN_NOTEBOOKS", "").split()
nb_merge_streams = True
# Progress bars, and the word that kernels compile.
nb_output_stderr = "remove"

# Equations are drawn by a file of the site itself, which npm brings (make docs); numbers in brackets are the paper's.
MATHJAX = HERE.parent / "out" / "npm" / "node_modules" / "mathjax" / "es5" / "tex-svg.js"
mathjax_path = MATHJAX.name

html_theme = "furo"
html_title = "BirthSIM"
LOGO = HERE.parent / "birthsim_live" / "page" / "icon.svg"
ON_DARK = {"#0e3480": "#9db8f5", "#5c646e": "#b4bcc6"}
"""Colours of the logo that a dark page would swallow -> what takes their place there."""
html_favicon = str(LOGO)
REPOSITORY = notebooks.repository()
html_baseurl = f"https://{REPOSITORY.replace(chr(47), '.github.io/')}/" if REPOSITORY else ""
html_theme_options = {"light_logo": "icon.svg", "dark_logo": "icon_dark.svg"}
if REPOSITORY:
    named = "Repository on GitHub"
    icon = {"name": named, "url": f"https://github.com/{REPOSITORY}", "html": named, "class": ""}
    html_theme_options["footer_icons"] = [icon]
html_static_path = ["_static", str(LOGO), str(MATHJAX), "pull.webp"]
html_css_files = ["site.css"]
html_js_files = ["access.js", "tables.js", "data.js", "words.js", "glossary.js", "disk.js"]
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


def told(app, page, source):
    """Say which notebook runs: make docs is silent else, for minutes."""
    if page.startswith("tutorials/") and page.partition("/")[2] in notebooks.NAMES and app.config.nb_execution_mode != "off":
        print(f"docs: running {page}", file=sys.stderr, flush=True)


def with_data(app, page, template, context, doctree):
    """Put each data file that a page links into the page, where data.js finds it: a page opened from a disk can fetch none."""
    for link in doctree.findall(download_reference) if doctree else ():
        file = HERE / posixpath.dirname(page) / link["reftarget"]
        if file.suffix == ".csv":
            app.add_js_file(None, body=file.read_text(encoding="utf-8"), type="text/csv", title=file.name)


def with_card(app, page, template, context, doctree):
    """Pictures load when they come into sight, and a page that is shared shows the rig."""
    body = context.get("body", "")
    context["body"] = body.replace("<img ", '<img loading="lazy" ')
    address = html_baseurl or "../" * page.count("/")
    # A title may hold code and mathematics, whose tags would end the attribute.
    plain = escape(Markup(context.get("title", "")).striptags())
    title = project if page == "index" else f"{plain} · {project}"
    context["metatags"] = (
        context.get("metatags", "")
        + f"""
<meta property="og:title" content="{title}">
<meta property="og:description" content="A fetal head on two air cylinders: pull it, and compare its controllers.">
<meta property="og:image" content="{address}rig/card.png"><meta name="twitter:card" content="summary_large_image">"""
    )


def with_notebook(app, page, template, context, doctree):
    """Below its title a tutorial says where it is to be had as a notebook."""
    folder, _, name = page.partition("/")
    if folder == "tutorials" and name in notebooks.NAMES:
        context["body"] = context["body"].replace("</h1>\n", f"</h1>\n{notebooks.links(name)}", 1)


def build_notebooks(app, exception):
    """The tutorials as files, beside the pages."""
    if exception is None and app.builder.name == "html":
        notebooks.write(app.outdir)


def build_words(app, exception):
    """The glossary for pages that use its words."""
    if exception is None and app.builder.name == "html":
        (app.outdir / "_static" / "words.js").write_text(words.script(), encoding="utf-8")


def build_logo(app, exception):
    """The logo for dark pages."""
    if exception is None and app.builder.name == "html":
        drawn = LOGO.read_text(encoding="utf-8")
        for light, dark in ON_DARK.items():
            if light not in drawn:
                raise ValueError(f"{LOGO} has no {light}; allowed in ON_DARK: colours of the logo")
            drawn = drawn.replace(light, dark)
        (app.outdir / "_static" / "icon_dark.svg").write_text(drawn, encoding="utf-8")


def build_rig(app, exception):
    """The folder of static files that runs the rig, beside the pages."""
    if exception is None and app.builder.name == "html":
        shutil.rmtree(app.outdir / "rig", ignore_errors=True)
        write_page(app.outdir / "rig", packed_page(birthsim_env.Parameters()))


def setup(app):
    """Write the generated parts before any page is read."""
    for name, role in {"install": install_role, "rig": rig_role}.items():
        app.add_role(name, role)
    stages.connect(app)
    app.connect("source-read", seen_from_the_site)
    app.connect("source-read", told)
    app.connect("html-page-context", with_data)
    app.connect("html-page-context", with_card)
    app.connect("html-page-context", with_notebook)
    app.connect("build-finished", build_logo)
    app.connect("build-finished", build_rig)
    app.connect("build-finished", build_words)
    app.connect("build-finished", build_notebooks)
    app.connect("builder-inited", lambda _: _generate.write(HERE.parent / "out" / "docs-generated"))
    return {"parallel_read_safe": False}
