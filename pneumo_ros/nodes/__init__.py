# SPDX-License-Identifier: Apache-2.0
"""Thin rclpy shells over the pure code: read parameters, convert messages, call a step, publish."""
