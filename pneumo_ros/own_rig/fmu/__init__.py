# SPDX-License-Identifier: Apache-2.0
"""A model from elsewhere, model.fmu (FMI 2 and 3), in place of rig.py.

The archive is checked and unpacked (:mod:`.archive`), the names of rig.yaml are found among its variables
(:mod:`.variables`), one instance of it is loaded by fmpy and reused (:mod:`.instance`), and the rig's own fixed-step
loop calls its functions from compiled code (:mod:`.exchange`); a co-simulation steps itself (:mod:`.stepping`).
"""
