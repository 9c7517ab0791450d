"""Speeds in asv's form. Results are ratios, so those of several machines may stand in one history.

In this folder: ``pip install asv``, ``asv machine --yes``, ``asv run HEAD^!``, ``asv publish``. gcc has to be there.
"""
