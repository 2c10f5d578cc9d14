"""The answer while the truck is driven: a bus or a replayed log through the core, to a terminal and a page."""
