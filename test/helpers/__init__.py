# SPDX-License-Identifier: Apache-2.0
"""What several tests share: small logs, simulated and serial rigs, sessions of their own domain, a browser."""
