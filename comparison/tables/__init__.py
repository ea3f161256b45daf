"""What a run gives: channels over time with events and extrema; read, checked, brought to equal times."""
