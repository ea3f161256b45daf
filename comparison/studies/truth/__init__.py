"""Both models against a true trajectory: do the uncertainties hold that a comparison rests on."""
