from __future__ import annotations

import os
import pty
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from pbrdf.errors import InstrumentError
from pbrdf.instruments.emulators.clock import VirtualClock
from pbrdf.instruments.manual import ManualTable, Operator


class _Typist:
    """A terminal at whose keys somebody types one line after another, each when a question is seen."""

    def __init__(self, *lines: str) -> None:
        self.master, self.slave = pty.openpty()
        self.terminal = os.ttyname(self.slave)
        self.screen = ""
        self._lines = list(lines)
        self._thread = threading.Thread(target=self._type, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._thread.join()
        os.close(self.slave)
        os.close(self.master)

    def _type(self) -> None:
        for line in self._lines:
            seen = ""
            while not seen.endswith("press Enter: "):
                seen += os.read(self.master, 4096).decode()
            self.screen += seen
            os.write(self.master, line.encode())


@pytest.fixture
def typists() -> Iterator[list[_Typist]]:
    made: list[_Typist] = []
    yield made
    for one in made:
        one.close()


def _table(typists: list[_Typist], *lines: str) -> ManualTable:
    typists.append(_Typist(*lines))
    return ManualTable("table", VirtualClock(), Operator(typists[-1].terminal), (0.0, 180.0))


def test_the_operator_is_asked_and_answers(typists: list[_Typist]) -> None:
    typists.append(_Typist(" 17 \n"))
    operator = Operator(typists[-1].terminal)
    assert operator.ask("lamp", "Cover it.") == "17"
    assert "lamp: Cover it. Then press Enter: " in typists[-1].screen


def test_enter_alone_is_an_answer(typists: list[_Typist]) -> None:
    typists.append(_Typist("\n"))
    assert Operator(typists[-1].terminal).ask("lamp", "Cover it.") == ""


def test_a_terminal_that_is_closed_without_an_answer_is_an_error(typists: list[_Typist]) -> None:
    typists.append(_Typist("\x04"))
    with pytest.raises(InstrumentError, match="lamp: operator: the question was not answered; run again"):
        Operator(typists[-1].terminal).ask("lamp", "Cover it.")


def test_without_a_terminal_there_is_a_remedy() -> None:
    with pytest.raises(InstrumentError, match=r"there is no terminal to ask on .*; run it from a terminal"):
        Operator("/dev/nothing").ask("lamp", "Cover it.")


ASK = """
from pbrdf.errors import InstrumentError
from pbrdf.instruments.manual import Operator
try:
    print("answer:", Operator().ask("lamp", "Cover it."))
except InstrumentError as error:
    print(error)
"""


def test_a_process_without_any_terminal_is_told_so() -> None:
    done = subprocess.run(
        [sys.executable, "-c", ASK],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        start_new_session=True,
        check=True,
    )
    assert "lamp: operator: there is no terminal to ask on" in done.stdout


def test_a_rule_whose_input_is_no_terminal_asks_on_the_one_it_was_started_from() -> None:
    typist = _Typist("done\n")
    # a session of its own makes the terminal that it opens first its controlling one
    adopt = f"import os; os.close(os.open({typist.terminal!r}, os.O_RDWR))\n"
    done = subprocess.run(
        [sys.executable, "-c", adopt + ASK],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        start_new_session=True,
        check=True,
    )
    assert done.stdout == "answer: done\n"
    typist.close()


def test_a_program_at_a_terminal_asks_there() -> None:
    typist = _Typist("done\n")
    done = subprocess.run(
        [sys.executable, "-c", ASK], stdin=typist.slave, stdout=subprocess.PIPE, text=True, check=True
    )
    assert done.stdout == "answer: done\n"
    typist.close()


def test_a_table_is_where_the_operator_says(typists: list[_Typist]) -> None:
    table = _table(typists, "2.5\n", "\n", "60,05°\n")
    table.home().wait()
    assert table.position_deg() == 2.5
    table.move_to(45.0).wait()
    assert table.position_deg() == 45.0
    table.move_to(60.0).wait()
    assert table.position_deg() == 60.05
    assert "Turn the arm to 45.000°, in the end from lower angles" in typists[-1].screen
    assert (table.name, table.identity.model) == ("table by hand", "manual table")


def test_the_operator_is_asked_again_until_the_angle_is_right(typists: list[_Typist]) -> None:
    table = _table(typists, "half past three\n", "10\n", "70\n", "oops\n", "60.05\n")
    table.home().wait()
    table.move_to(60.0).wait()
    assert table.position_deg() == 60.05
    assert typists[-1].screen.count("Turn the arm") == 3


def test_the_question_is_put_when_the_movement_is_awaited(typists: list[_Typist]) -> None:
    table = _table(typists)
    table.move_to(45.0)
    assert typists[-1].screen == ""


@pytest.mark.parametrize("angle", [-0.1, 180.1])
def test_an_angle_beyond_the_limits_is_not_asked_for(typists: list[_Typist], angle: float) -> None:
    with pytest.raises(InstrumentError, match=r"angle: .*° is not within 0° to 180°; choose"):
        _table(typists).move_to(angle)


def test_an_angle_is_not_known_before_it_was_read(typists: list[_Typist]) -> None:
    with _table(typists) as table:
        table.stop()
        with pytest.raises(InstrumentError, match="angle: is not known yet; home it first"):
            table.position_deg()
