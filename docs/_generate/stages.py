"""What a build of the site is at, with the seconds since its beginning: Sphinx itself is quiet, and notebooks take minutes."""

import time

BEGAN = time.monotonic()


def stage(words: str) -> None:
    """Print a stage."""
    print(f"{time.monotonic() - BEGAN:5.0f} s  {words}", flush=True)


def connect(app) -> None:
    """Name the stages that Sphinx runs through."""
    app.connect("env-before-read-docs", lambda app, env, pages: stage(f"reading {len(pages)} pages"))
    app.connect("source-read", lambda app, page, source: stage(f"running {page}") if "{code-cell}" in source[0] else None)
    app.connect("env-updated", lambda app, env: stage("writing pages"))
    app.connect("build-finished", lambda app, exception: stage("done" if exception is None else "failed"), priority=900)
