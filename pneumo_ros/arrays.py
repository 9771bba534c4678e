# SPDX-License-Identifier: Apache-2.0
"""Names for the arrays that all numerics pass around."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
