# SPDX-License-Identifier: Apache-2.0
"""What the maker holds the model form to be worth travels with the rig, and is zero where nobody states it."""

from __future__ import annotations

import pytest

from pneumo_ros.errors import InputError
from pneumo_ros.rig import load_rig, parse_rig


def test_absent_is_zero_and_leaves_the_text_as_it_was() -> None:
    rig = load_rig()
    assert rig.model_form.value == 0.0 and "model_form" not in rig.to_yaml()


@pytest.mark.parametrize("text", ["rig: {model_form: {value: 0.05, unit: '1'}}",
                                  "rig: {name: bench}\nmodel_form: {value: 0.05, unit: '1'}"])  # fmt: skip
def test_stated_with_the_rig_or_beside_it(text: str) -> None:
    rig = parse_rig(text)
    assert rig.model_form.value == 0.05
    assert parse_rig(rig.to_yaml()).model_form.value == 0.05


def test_more_than_half_of_the_signal_is_refused() -> None:
    with pytest.raises(InputError, match=r"model_form.*0 to 0.5"):
        parse_rig("rig: {model_form: {value: 0.7, unit: '1'}}")
