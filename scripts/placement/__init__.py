"""Parts of `scripts/reproduce_placement`."""
