# SPDX-License-Identifier: Apache-2.0
"""Many rigs by dates: which logs of a folder belong together, what was found in each, which effect grows where.

It reads names of files and finished diagnoses (diagnosis.json), and knows no engine.
"""
