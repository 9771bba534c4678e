# SPDX-License-Identifier: Apache-2.0
"""Free-running simulation fitted to logs: the problem, the solver, windows, command events, uncertainty."""
