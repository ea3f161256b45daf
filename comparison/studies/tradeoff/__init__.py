"""Speed against accuracy: every way to run a scene over its settings, what each costs and what it gives."""
