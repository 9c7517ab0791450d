"""The bits of physics and controllers are pinned to stored hashes; ``make golden`` makes them anew, and those of new ones."""

import json

from tests.oracles.golden import fingerprints


def test_the_same_bits_as_on_every_other_processor():
    """Only + - * / and sqrt decide an episode, which IEEE 754 rounds correctly everywhere."""
    stored, rows = json.loads(fingerprints.FILE.read_text(encoding="utf-8")), fingerprints.rows()
    assert {name: fingerprints.fingerprint(*rows[name]) for name in stored} == stored
