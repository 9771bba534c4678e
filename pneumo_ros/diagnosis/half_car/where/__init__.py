# SPDX-License-Identifier: Apache-2.0
"""Where the half car's gap lives: equations in weak form, flexible corrections by place, regimes, conditional runs."""

from pneumo_ros.diagnosis.half_car.where.conditional import conditional_gaps as conditional_gaps
from pneumo_ros.diagnosis.half_car.where.corrected_run import place_gaps as place_gaps
from pneumo_ros.diagnosis.half_car.where.corrected_run import predict_located as predict_located
from pneumo_ros.diagnosis.half_car.where.gain import FlexibleGain as FlexibleGain
from pneumo_ros.diagnosis.half_car.where.gain import flexible_gain as flexible_gain
from pneumo_ros.diagnosis.half_car.where.held_equations import HeldEquations as HeldEquations
from pneumo_ros.diagnosis.half_car.where.held_equations import held_equations as held_equations
from pneumo_ros.diagnosis.half_car.where.latent import latent_places as latent_places
from pneumo_ros.diagnosis.half_car.where.law import Law as Law
from pneumo_ros.diagnosis.half_car.where.law import missing_law as missing_law
from pneumo_ros.diagnosis.half_car.where.locate import Location as Location
from pneumo_ros.diagnosis.half_car.where.locate import Start as Start
from pneumo_ros.diagnosis.half_car.where.locate import locate as locate
from pneumo_ros.diagnosis.half_car.where.regions import Occurrence as Occurrence
from pneumo_ros.diagnosis.half_car.where.regions import occurrence as occurrence
