"""The verdict under test: false alarms, seeded faults, and the scenes that both models run."""
