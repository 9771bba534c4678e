"""The gap between a log and the model: where it lies, which unmodelled effect makes it, how far it shrinks."""
