"""Ultrasonic ranging: from a microphone's voltage to distances with confidences."""
