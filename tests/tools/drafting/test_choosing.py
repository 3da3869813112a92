"""Of the ways to read a table the likeliest is taken."""

import pytest

from support.foreign_files import ships_radar
from vedette_tools.drafting.choosing import likeliest
from vedette_tools.drafting.reading import Reading, opened
from vedette_tools.drafting.recognising import read_table


@pytest.mark.costly
def test_a_reading_by_which_fewer_returns_lie_on_tracks_is_no_likelier(tmp_path):
    """Without its heading 260 returns of this ship's radar lie on tracks, with it 376."""
    path = tmp_path / "radar.csv"
    path.write_text(ships_radar(16).text)
    table = read_table(path)
    assert "heading" in likeliest(Reading.of(table, opened(table))).table.platform
