"""Inertial telemetry: 12-bit levels to bits on a wire, and back (docs/telemetry.md)."""
