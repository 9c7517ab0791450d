"""What stands here is no part of this tree: a test copies each recipe into a tree of its own."""

collect_ignore_glob = ["*"]
