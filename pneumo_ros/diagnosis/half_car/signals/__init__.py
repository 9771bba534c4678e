# SPDX-License-Identifier: Apache-2.0
"""A log on one time base: what was measured, commanded and driven, with what is missing or doubtful said."""

from pneumo_ros.diagnosis.half_car.signals.pair import check_pair as check_pair
from pneumo_ros.diagnosis.half_car.signals.prepare import prepare as prepare
from pneumo_ros.diagnosis.half_car.signals.source import read_signals as read_signals
from pneumo_ros.diagnosis.half_car.signals.source import topics_of as topics_of
from pneumo_ros.diagnosis.half_car.signals.types import COMMANDS as COMMANDS
from pneumo_ros.diagnosis.half_car.signals.types import MEASURED as MEASURED
from pneumo_ros.diagnosis.half_car.signals.types import ROADS as ROADS
from pneumo_ros.diagnosis.half_car.signals.types import Signals as Signals
from pneumo_ros.diagnosis.signals.types import Limitation as Limitation
from pneumo_ros.diagnosis.signals.types import TopicData as TopicData
from pneumo_ros.diagnosis.signals.types import TopicTiming as TopicTiming
