"""The web server, its messages, and what the windows of the page share."""
