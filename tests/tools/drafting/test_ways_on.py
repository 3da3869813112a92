"""What no draft reads is refused with words that hold of it, and with what to type next."""

import json
import re
import subprocess

import pytest

from vedette.errors import InputError
from vedette_files.tables.columnar import header_and_rows
from vedette_tools.drafting.recognising import NO_WISHES, read_table
from vedette_tools.drafting.wishes import Wishes

ROWS = "\n".join(f"{k}\t{k + 1}.5\t{-k}\t3" for k in range(30))
MARKERS = f"NO_OF_FRAMES\t30\nFREQUENCY\t100\nMARKER_NAMES\tM1\n{ROWS}\n"
SP3 = "#dP2023  6  5  0  0  0.00000000      96 ORBIT IGS20 HLM  IGS\n## 2265  86400.0   900.0 60100 0.0\n" + "\n".join(
    f"*  2023  6  5  0 {k}  0.0\nPG01  26560.{k}  2.5  3.5  123.4\nPG02  26560.{k}  2.5  3.5  123.4" for k in range(20)
)
MODE_S = "\n".join(f'{1457996400 + k},"8D406B909945DE10000405999BE4","406B90",19' for k in range(20))
SPLINES = "41 - the number\n" + "\n".join(f"{k}.5 {-k}.5 {k} 91.9 - (2D point, m_id)" for k in range(20))


@pytest.mark.parametrize(
    ("text", "told", "not_told"),
    [(SP3, "SP3", "titled.csv"), (MODE_S, "Mode S", "titled.csv"), (SPLINES, "no line", "several lines")],
    ids=["orbits", "raw messages", "splines"],
)
def test_what_is_no_table_is_called_so(text, told, not_told, tmp_path):
    (tmp_path / "d.txt").write_text(text + "\n")
    with pytest.raises(InputError) as caught:
        read_table(tmp_path / "d.txt")
    assert told in str(caught.value)
    assert not_told not in str(caught.value)


def test_words_above_rows_name_no_objects_and_the_recipe_leaves_them_out(tmp_path):
    """They became the column `id`."""
    (tmp_path / "d.tsv").write_text(MARKERS)
    with pytest.raises(InputError) as caught:
        read_table(tmp_path / "d.tsv")
    recipe = re.search(r"\(echo .*", str(caught.value))[0]
    assert recipe.startswith("(echo 'c1\tc2\tc3\tc4'")
    subprocess.run(recipe, shell=True, check=True, cwd=tmp_path)
    assert (tmp_path / "titled.csv").read_text() == f"c1\tc2\tc3\tc4\n{ROWS}\n"


@pytest.mark.parametrize(
    ("lists", "chosen"),
    [
        ({"images": [{"id": 1}], "annotations": [{"image_id": k, "x": k} for k in range(9)]}, '."annotations"'),
        ({"meta": {"use": True}, "results": {"a1": [{"x": 1}], "b2": [{"x": 2}]}}, '[."results"[][]]'),
    ],
    ids=["lists", "lists by name"],
)
def test_of_several_lists_it_is_said_how_to_take_one(lists, chosen, tmp_path):
    (tmp_path / "d.json").write_text(json.dumps(lists))
    with pytest.raises(InputError) as caught:
        header_and_rows(tmp_path / "d.json", ())
    assert f"jq '{chosen}' {tmp_path / 'd.json'}" in str(caught.value)


@pytest.mark.parametrize("wishes", [NO_WISHES, Wishes(rate=25.0)])
def test_a_column_that_counts_is_named_with_what_to_say(wishes, tmp_path):
    rows = "\n".join(f"{k // 2},{k}.5,{k % 7}.25" for k in range(40))
    (tmp_path / "d.csv").write_text(f"image_id,x,y\n{rows}\n")
    with pytest.raises(InputError) as caught:
        read_table(tmp_path / "d.csv", wishes=wishes)
    assert "--time image_id --rate" in str(caught.value)


def test_rows_that_are_frames_are_numbered_by_what_is_said(tmp_path):
    rows = "\n".join(f"{k * 0.31:.2f},{7 - k * 0.17:.2f}" for k in range(40))
    (tmp_path / "d.csv").write_text(f"x,y\n{rows}\n")
    with pytest.raises(InputError) as caught:
        read_table(tmp_path / "d.csv", wishes=Wishes(rate=10.0))
    recipe = re.search(r"awk .* > numbered.csv", str(caught.value))[0]
    subprocess.run(recipe, shell=True, check=True, cwd=tmp_path)
    table = read_table(tmp_path / "numbered.csv", wishes=Wishes(rate=10.0))
    assert (table.time.title, table.time_unit) == ("frame", "0.1 s")


def test_a_latitude_that_ais_sends_for_none_is_called_so(tmp_path):
    rows = "\n".join(f"{k},219000001,{91.0 if k == 5 else 55 + k / 1000},12.5" for k in range(40))
    (tmp_path / "d.csv").write_text(f"time,MMSI,lat,lon\n{rows}\n")
    from vedette_tools.drafting.reading import opened

    (problem,) = opened(read_table(tmp_path / "d.csv")).refused
    assert "AIS" in problem.text
    assert "longitude" not in problem.text
