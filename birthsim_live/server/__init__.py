"""The web server, its messages, and what all clients share."""
