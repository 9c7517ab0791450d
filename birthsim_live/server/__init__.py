"""The web server: the page's files, and controllers that run in Python."""
