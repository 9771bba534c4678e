# SPDX-License-Identifier: Apache-2.0
"""Which structures are worth a fit, which are fitted, and which the kept blocks prefer."""
