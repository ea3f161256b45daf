"""Execution of scenes by models in worker processes, with a cache of finished runs."""
