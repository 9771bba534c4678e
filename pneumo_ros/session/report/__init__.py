# SPDX-License-Identifier: Apache-2.0
"""One HTML page a session: figures, pictures, timing, trips, and everything that explains the run."""

from pneumo_ros.session.report.page import write_report as write_report
