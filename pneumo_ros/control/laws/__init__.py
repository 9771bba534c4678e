# SPDX-License-Identifier: Apache-2.0
"""Control laws: from the tracking error of one output to the third derivative wanted of it."""
