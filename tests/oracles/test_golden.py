"""The bits of physics and controllers are pinned to stored hashes; ``make golden`` makes them anew."""

import json

from tests.oracles.golden import fingerprints


def test_the_same_bits_as_on_every_other_processor():
    """Only + - * / and sqrt decide an episode, which IEEE 754 rounds correctly everywhere."""
    stored = json.loads(fingerprints.FILE.read_text(encoding="utf-8"))
    assert {name: fingerprints.fingerprint(*row) for name, row in fingerprints.rows().items()} == stored
