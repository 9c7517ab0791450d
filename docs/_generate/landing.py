"""Roles of the pages that a newcomer meets: a rig that runs in the page, and how BirthSIM is installed."""

from html import escape

from docutils import nodes

from _generate.notebooks import repository

FILMS = {"controller=backstepping": "pull.webp"}
"""What a page of the rig is asked for -> the film that shows the same, for pages that are opened from a disk (disk.js)."""


def rig_role(name, rawtext, text, lineno, inliner, options=None, content=()):
    """The page of the rig, embedded; ``text`` is what its address asks for."""
    up = "../" * inliner.document.settings.env.docname.count("/")
    source = f"{up}rig/index.html?embed=1&{text}"
    film = f' data-film="{up}_static/{FILMS[text]}"' if text in FILMS else ""
    title = f"The rig in the browser: {escape(text)}"
    frame = f'<iframe class="rig" src="{escape(source)}" title="{title}" loading="lazy"{film}></iframe>'
    return [nodes.raw("", frame, format="html")], []


def install_role(name, rawtext, text, lineno, inliner, options=None, content=()):
    """The line that installs the extras ``text``: from the repository where the site has one, else from a clone."""
    where = repository()
    source = f"'birthsim[{text}] @ git+https://github.com/{where}'" if where else f"-c constraints.txt -e '.[{text}]'"
    line = nodes.literal("", f"pip install {source}")
    if not where:
        return [nodes.strong("", "Install"), nodes.Text(" from a clone: "), line], []
    link = nodes.reference("", where, refuri=f"https://github.com/{where}")
    return [nodes.strong("", "Install"), nodes.Text(": "), line, nodes.Text(" from "), link], []
