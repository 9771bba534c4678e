# SPDX-License-Identifier: Apache-2.0
"""A model from elsewhere, model.fmu (FMI 2 and 3), in place of rig.py.

Its way: the archive is looked at and unpacked (``archive``), the names of rig.yaml are found among its variables
(``variables``), one instance of it is loaded by fmpy and reused (``instance``), and the rig's own fixed-step loop calls
its functions from compiled code (``exchange``); a co-simulation steps itself (``stepping``).
"""
