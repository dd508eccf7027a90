"""The Sparse Inertial Poser's experiments (von Marcard 2017) on simulated boards."""
