"""The driver box's wires: telemetry codec and ultrasonic detection, in NumPy and SciPy."""
