"""Scenes run by models, in processes of their own, and what is finished kept."""
