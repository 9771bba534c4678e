# SPDX-License-Identifier: Apache-2.0
"""What the thesis leaves out, read from config/thesis.yaml: one flat table, checked like every other parameter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pneumo_ros.documents import parse_yaml
from pneumo_ros.errors import InputError
from pneumo_ros.parameters import Parameter, settings
from pneumo_ros.paths import share_file
from pneumo_ros.road import ISO_MEAN, RoadSpec

PARAMETERS: tuple[Parameter, ...] = (
    Parameter("seeds", 5, "1", "roads per figure; rms over all of them", 1, 100),
    Parameter("duration", 10.0, "s", "length of each run", 4.0, 600.0),
    Parameter("settle", 3.0, "s", "left out of every rms (Section 6.3)", 0.0, 60.0),
    Parameter("period", 0.002, "s", "control period", 1e-4, 0.02),
    Parameter("iso_class", "D", "", "road class", choices=tuple(ISO_MEAN)),
    Parameter("speed_kmh", 80.0, "km/h", "full-scale speed", 1.0, 300.0),
    Parameter("low_hz", 0.5, "Hz", "lowest frequency of the road", 0.01, 50.0),
    Parameter("high_hz", 30.0, "Hz", "highest frequency of the road", 0.1, 250.0),
    Parameter("quarter_mass", 25.165, "kg", "sprung mass of the quarter car", 1.0, 100.0),
    Parameter("quarter_outlet_in2", 0.01, "in^2", "outlet opening of the quarter car", 1e-4, 0.1),
    Parameter("quarter_damping", 50.0, "N s/m", "bushing damping of the quarter car", 0.0, 1e4),
    Parameter("start_height_in", 1.5, "in", "spring height a controlled quarter car starts from", 1.25, 2.1),
    Parameter("estimator_bandwidth", 200.0, "1/s", "lambda_0 of Eq. 6.51 with exact accelerations", 1.0, 500.0),
    Parameter("bench_amplitude_in", 0.002, "in", "base motion of Tables 5.4 and 5.5", 1e-4, 0.2),
    Parameter("bench_damping", 50.0, "N s/m", "c of Eq. 5.8", 0.0, 1e4),
)


@dataclass(frozen=True)
class ThesisSettings:
    """The values of :data:`PARAMETERS`, typed."""

    seeds: int
    duration: float
    settle: float
    period: float
    iso_class: str
    speed_kmh: float
    low_hz: float
    high_hz: float
    quarter_mass: float
    quarter_outlet_in2: float
    quarter_damping: float
    start_height_in: float
    estimator_bandwidth: float
    bench_amplitude_in: float
    bench_damping: float

    @property
    def periods(self) -> int:
        """Control periods of a run."""
        return round(self.duration / self.period)

    @property
    def settled(self) -> int:
        """First sample that counts."""
        return round(self.settle / self.period)

    def road(self, seed: int, **changes: float | str) -> RoadSpec:
        """The road of a seed (1, 2, ...)."""
        values: dict[str, float | str] = {
            "iso_class": self.iso_class,
            "speed_kmh": self.speed_kmh,
            "low_hz": self.low_hz,
            "high_hz": self.high_hz,
        }
        return RoadSpec(seed=seed, **{**values, **changes})  # type: ignore[arg-type]


def load_settings(path: str | Path | None = None) -> ThesisSettings:
    """Read the settings; without a path, the ones that ship with the package.

    Raises
    ------
    InputError
        naming file, key, value and allowed range.
    """
    source = Path(path) if path is not None else share_file("config", "thesis.yaml")
    try:
        text = source.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the settings ({error})", where=source, remedy="give a YAML file") from error
    document = parse_yaml(text, source)
    if not isinstance(document, Mapping) or not isinstance(document.get("thesis"), Mapping):
        raise InputError("no mapping 'thesis:' found", where=source, remedy="start from config/thesis.yaml")
    return ThesisSettings(**settings(PARAMETERS, document["thesis"], source))  # type: ignore[arg-type]
