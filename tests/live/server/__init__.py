"""The server as browsers and strangers meet it."""
