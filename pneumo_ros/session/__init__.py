# SPDX-License-Identifier: Apache-2.0
"""The course of a session: stages of a control period, plan, supervision, replay, summary, picture and report."""
