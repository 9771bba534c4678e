# SPDX-License-Identifier: Apache-2.0
"""Active pneumatic half-car rig: simulate, drive, log, replay, and diagnose the sim-to-real gap."""


def __getattr__(name: str) -> str:
    """``__version__``, as it was installed, when it is asked for: who loads the package has yet to heed Ctrl-C.

    setup.py and package.xml carry the number, and ROS's release tool writes both in one step.
    """
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(__name__)
    except PackageNotFoundError:  # run from a copy of the sources that was never installed
        return "unknown"
