"""Names of methods (`Solution.method`) that others tell apart."""

FILTER, SMOOTHER = "ekf", "ekf_smoothed"
FILTERS = (FILTER, SMOOTHER)
"""Methods whose constants come from the rest hold, and whose statistics are innovations."""
