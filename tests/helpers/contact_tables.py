"""Tables of contacts."""

import pandas as pd


def contacts_of(*rows):
    """Return a table of contacts from corner, start and end of each."""
    return pd.DataFrame(rows, columns=["corner", "start", "end"])
