"""How work is shared out, stored and continued."""
