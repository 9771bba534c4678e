# SPDX-License-Identifier: Apache-2.0
"""A session from plan to report: stages of a control period, plan, supervision, replay, summary, picture and report."""
