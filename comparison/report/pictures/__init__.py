"""Pictures of result tables: in files, and in notebooks."""
