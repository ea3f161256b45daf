"""The paper's figures and statements, one by one, against both models."""
