"""`vedette check --law`: one law alone, a closing count, and an exit code of its own where nothing was tested."""

from vedette.cli import main


def test_one_law_is_tried_and_counted(capsys):
    assert main(["check", "constant_velocity", "--law", "two_steps_make_one"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].strip() == "1 held"


def test_where_no_law_applies_nothing_was_tested(capsys):
    assert main(["check", "range_bearing", "--law", "linear_as_declared"]) == 4
    assert capsys.readouterr().out.splitlines()[-1].strip().startswith("1 skipped: ")


def test_a_law_that_there_is_not_is_wrong_use(capsys):
    assert main(["check", "constant_velocity", "--law", "two_step_make_one"]) == 2
    assert "two_steps_make_one" in capsys.readouterr().err
