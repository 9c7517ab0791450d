"""What tests of the page without a server lack."""

from __future__ import annotations

from importlib.util import find_spec

from tests.live import browser


def lack() -> str:
    """It and how to install it, in words, or an empty string."""
    return browser.missing() or ("" if find_spec("ziglang") else "the static page's tests need pip install 'birthsim[build]'")
