"""The live page in headless Chromium, against a real server."""
