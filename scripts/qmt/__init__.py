"""Parts of `scripts/reproduce_qmt`."""
