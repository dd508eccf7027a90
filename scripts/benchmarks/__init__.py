"""What `scripts/benchmark` measures: speed, start-up and memory, each against a target."""
