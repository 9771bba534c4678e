"""Active pneumatic half-car rig: simulate, drive, log, replay, and diagnose the sim-to-real gap."""

__version__ = "0.3.0"
