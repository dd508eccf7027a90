"""Parts of `scripts/reproduce_opensense`."""
