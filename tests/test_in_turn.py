"""Sources of a signal that give it one after another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from oncenter.read.clock import samples_in_file
from oncenter.read.in_turn import in_turn
from oncenter.read.samples import Samples

TIME = np.arange(1000) / 100


def sender(address: int, begin: int, end: int, kind: str = "VDC2") -> Samples:
    """It sends at all times, and gives numbers between two rows."""
    values = np.where((np.arange(1000) >= begin) & (np.arange(1000) < end), 0.01 * np.arange(1000), np.nan)
    lost = {"not_available": 1000 - (end - begin)}
    labels = (f"0x{address:02x}", kind.lower())
    return Samples(
        "yaw_rate", TIME, values, kind, f"{kind} from 0x{address:02X}", 0, address, labels, of_frames=True, lost=lost
    )


def test_a_sender_that_changes_its_address_is_one_source() -> None:
    notes: list[str] = []
    (one,) = in_turn([sender(0x13, 500, 990), sender(0x3E, 10, 500)], (), notes)
    assert np.array_equal(one.time, TIME[10:990])
    assert np.array_equal(one.values, 0.01 * np.arange(10, 990))
    assert one.description == "VDC2 from 0x3E, then VDC2 from 0x13" and {"0x3e", "0x13"} <= set(one.labels)
    assert samples_in_file(one) == 2000
    assert notes == [
        "yaw_rate: VDC2 from 0x3E, after 4.9 s VDC2 from 0x13 send one after another, and are used as one source"
    ]


def test_senders_that_overlap_or_are_chosen_or_of_other_messages_stay_apart() -> None:
    early, late = sender(0x3E, 10, 500), sender(0x13, 500, 990)
    assert len(in_turn([early, sender(0x13, 499, 990)], (), [])) == 2
    assert len(in_turn([early, late], ("yaw_rate",), [])) == len(in_turn([early, late], ("all",), [])) == 2
    assert len(in_turn([early, sender(0x13, 500, 990, "EBC9")], (), [])) == 2
    assert len(in_turn([early, sender(0x13, 500, 500)], (), [])) == 2  # never a number
    columns = [replace(each, kind="column") for each in (early, late)]
    assert len(in_turn(columns, (), [])) == 2
    assert len(in_turn([replace(each, description="column r") for each in columns], (), [])) == 1
