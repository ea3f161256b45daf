"""Both models against a true trajectory: a test of the uncertainties that a comparison rests on."""
