# SPDX-License-Identifier: Apache-2.0
"""What a person gets to see of a diagnosis: one HTML page, and a log of residuals for plotting tools."""

from pneumo_ros.diagnosis.report.contents import Findings as Findings
from pneumo_ros.diagnosis.report.outputs import claim_folder as claim_folder
from pneumo_ros.diagnosis.report.outputs import write_outputs as write_outputs
from pneumo_ros.diagnosis.report.page import render as render
from pneumo_ros.diagnosis.report.page import write_report as write_report
from pneumo_ros.diagnosis.report.residual_log import write_residual_log as write_residual_log
from pneumo_ros.diagnosis.report.steps import Asked as Asked
from pneumo_ros.diagnosis.report.story import Story as Story
