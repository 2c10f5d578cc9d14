"""The answer while it is driven: a bus or a replayed log through the core, on a terminal and a page."""
