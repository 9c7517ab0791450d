"""The commands, a module each: ``Settings``, which its options are read from, and ``main``, which acts on them."""
