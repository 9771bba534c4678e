"""Controllers: feedback linearisation, model reference and the sliding mode family. Pure steps, explicit state."""
