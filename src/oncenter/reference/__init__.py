"""Chapter 3: the offset measured by driving a straight both ways."""
