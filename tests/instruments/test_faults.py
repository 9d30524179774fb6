from __future__ import annotations

from pbrdf.instruments.emulators.faults import Faults


def test_nothing_strikes_unless_armed() -> None:
    assert not Faults().strikes("stall")
    assert Faults([{"fault": "stall"}]).value("other", absent=7) == 7


def test_a_fault_strikes_once_by_default() -> None:
    faults = Faults([{"fault": "stall"}])
    assert [faults.strikes("stall") for _ in range(3)] == [True, False, False]


def test_a_fault_waits_for_its_occasion_and_strikes_so_often() -> None:
    faults = Faults([{"fault": "stall", "after": 2, "count": 2}])
    assert [faults.strikes("stall") for _ in range(6)] == [False, False, True, True, False, False]


def test_a_fault_with_a_negative_count_strikes_for_ever() -> None:
    faults = Faults([{"fault": "dead", "count": -1}])
    assert all(faults.strikes("dead") for _ in range(100))


def test_a_fault_has_its_value_or_the_one_of_who_asks() -> None:
    faults = Faults([{"fault": "error", "value": 9}, {"fault": "error"}])
    assert [faults.value("error", absent=0, struck=1) for _ in range(3)] == [9, 1, 0]


def test_a_value_of_zero_strikes() -> None:
    assert Faults([{"fault": "offset", "value": 0}]).strikes("offset")


def test_faults_armed_one_after_another_strike_one_after_another() -> None:
    faults = Faults()
    faults.arm("error", value=4)
    faults.arm("error", after=1, value=6)
    assert [faults.value("error", absent=0) for _ in range(4)] == [4, 0, 6, 0]
