"""The page without a server: what its worker needs besides the page, as a folder of static files."""
