"""Where the gap lives: equation residuals in weak form, flexible corrections by place, regimes, conditional runs."""

from pneumo_ros.gap.where.conditional import conditional_gaps as conditional_gaps
from pneumo_ros.gap.where.gain import FlexibleGain as FlexibleGain
from pneumo_ros.gap.where.gain import flexible_gain as flexible_gain
from pneumo_ros.gap.where.habitat import Habitat as Habitat
from pneumo_ros.gap.where.habitat import habitat as habitat
from pneumo_ros.gap.where.law import Law as Law
from pneumo_ros.gap.where.law import missing_law as missing_law
from pneumo_ros.gap.where.locate import Location as Location
from pneumo_ros.gap.where.locate import Start as Start
from pneumo_ros.gap.where.locate import locate as locate
from pneumo_ros.gap.where.replay import place_gaps as place_gaps
from pneumo_ros.gap.where.replay import predict_located as predict_located
