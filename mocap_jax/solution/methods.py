"""Names of methods (`Solution.method`) that others tell apart."""

FILTER, SMOOTHER = "ekf", "ekf_smoothed"
UNSCENTED_FILTER, UNSCENTED_SMOOTHER = "ukf", "ukf_smoothed"
FILTER_OF = {SMOOTHER: FILTER, UNSCENTED_SMOOTHER: UNSCENTED_FILTER}
"""The filter that each smoother starts from."""
SMOOTHERS = tuple(FILTER_OF)
FILTERS = (FILTER, UNSCENTED_FILTER, *SMOOTHERS)
"""Methods whose constants come from the rest hold, and whose statistics are innovations."""
