"""The role ``figure``: prose takes a figure from results/*.json by its name."""

from docutils import nodes

from lab.studies.figures import figure


def figure_role(name, rawtext, text, lineno, inliner, options=None, content=()):
    """The figure that ``lab.studies.figures`` finds; an unknown name fails the build."""
    try:
        return [nodes.Text(figure(text))], []
    except ValueError as error:
        message = inliner.reporter.error(str(error), line=lineno)
        return [inliner.problematic(rawtext, rawtext, message)], [message]
