"""Parts of `scripts/reproduce_arm_ukf`."""
