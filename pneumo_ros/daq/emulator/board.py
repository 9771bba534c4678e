# SPDX-License-Identifier: Apache-2.0
"""The rig's board as it presents itself: the identity that the emulator and the checks use."""

from __future__ import annotations

from pneumo_ros.daq.frames import Channel, Hello, InputRange, OutputRange, Valve

FIRMWARE = (1, 0, 0)
SAMPLE_PERIOD_US = 1000
WATCHDOG_US = 40_000
CLOSED = 0  # counts of a closed valve, which is also what it gets without power


def board_identity(
    *,
    boot_id: int = 1,
    serial_number: str = "EMULATED-0001",
    adc_bits: int = 16,
    dac_bits: int = 12,
    input_volts: tuple[float, float] = (-10.0, 10.0),
    output_volts: tuple[float, float] = (0.0, 10.0),
    watchdog_us: int = WATCHDOG_US,
) -> Hello:
    """HELLO of a board with equal ranges on all inputs and on all outputs.

    Parameters
    ----------
    boot_id : another value after every reset
    adc_bits, dac_bits : converter widths
    input_volts, output_volts : (lowest, highest), V
    watchdog_us : longest time without a command while armed, us
    """
    low, high = (round(v * 1e6) for v in input_volts)
    closed, full = (round(v * 1e6) for v in output_volts)
    return Hello(
        nonce=0,
        boot_id=boot_id,
        session=0,
        device_us=0,
        sample_period_us=SAMPLE_PERIOD_US,
        watchdog_us=watchdog_us,
        firmware=FIRMWARE,
        adc_bits=adc_bits,
        dac_bits=dac_bits,
        serial_number=serial_number,
        inputs=tuple(InputRange(channel, low, high) for channel in Channel),
        outputs=tuple(OutputRange(valve, closed, full, CLOSED) for valve in Valve),
    )
