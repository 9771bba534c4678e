# SPDX-License-Identifier: Apache-2.0
"""Second laws of every family, one room by what they act on; none of them is a law of the effects' library."""
