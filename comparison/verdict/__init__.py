"""The judge: verdicts on two results, their confirmation, and what a difference is due to."""
