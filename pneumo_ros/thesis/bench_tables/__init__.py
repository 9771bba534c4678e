# SPDX-License-Identifier: Apache-2.0
"""What does the Chapter 5 model miss in the thesis's own measurements, Tables 5.4 and 5.5 (errata 16)?"""

from pneumo_ros.thesis.bench_tables.compete import Judged as Judged
from pneumo_ros.thesis.bench_tables.compete import TableDiagnosis as TableDiagnosis
from pneumo_ros.thesis.bench_tables.compete import diagnose_table as diagnose_table
from pneumo_ros.thesis.bench_tables.compete import diagnose_tables as diagnose_tables
