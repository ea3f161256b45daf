"""Result tables: channels over time with events and extrema; reading, validation, alignment in time."""
