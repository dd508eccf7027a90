"""Names of sites say of what kind a device on them is; boards have sites of their own names."""

SOURCE_PREFIX = "source/"
"""Of an ultrasonic source that somebody wears."""
ANCHOR_PREFIX = "anchor/"
"""Of a source or receiver that stands in the room."""
PREFIXES = (ANCHOR_PREFIX, SOURCE_PREFIX)
"""All of them."""
