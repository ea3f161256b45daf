"""Execution of scenes by models in worker processes; finished runs and rows of studies are stored."""
