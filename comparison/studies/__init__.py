"""What the committed reports say about the current code: each study writes its own."""
