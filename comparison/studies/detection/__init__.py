"""The gate's own test: false alarms, detected faults and the smallest change that is detected."""
