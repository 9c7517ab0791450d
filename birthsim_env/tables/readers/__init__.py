"""Readers of tables, a kind of file each.

A reader takes how errors call the file, its content and a ``Reading``, and returns a ``Table``; it is registered in its own
file for an ending, ``@register(reader=".csv", about="...")``. One that ``needs={"extra log"}`` imports it when it reads.
"""
