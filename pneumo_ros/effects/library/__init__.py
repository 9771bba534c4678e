# SPDX-License-Identifier: Apache-2.0
"""The effects of the library, one file each, named by their id in the log and diagnosis contract."""
