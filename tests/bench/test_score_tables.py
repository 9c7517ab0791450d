"""The scores' tables: who is best is named, and the data file has everybody, the worst first."""

import csv

from baselines.bench.measures import DISCOUNTS
from birthsim_env.scores import ROLES
from lab.studies.scores.tables import Scored, data, overview


def row(paid, error):
    return {"returns": {str(one): one * paid for one in DISCOUNTS}, "error": error, "success": 0.25, "lost": 0.5}


ROWS = {"best": row(30.0, 0.5), "law": row(20.0, 2.0), "shut": row(10.0, 40.0), "random": row(5.0, None)}
NAMES = dict(zip(ROLES, ("shut", "random", "law", "best"), strict=False))
PLAYED = {role: {"controller": name, "return": ROWS[name]["returns"]["1.0"]} for role, name in NAMES.items()}
FOUND = [Scored("Circle", "ideal", "drawn", ROWS, PLAYED)]


def test_the_overview_names_the_best_and_says_where_there_is_none():
    assert overview(FOUND).splitlines()[2] == "| Circle | ideal | randomised | -25 | 50 | 100, best | - |"


def test_the_data_file_has_every_controller_with_its_returns():
    table = list(csv.DictReader(data(FOUND).splitlines()))
    assert [(one["controller"], one["normalised return"], one["error, mm"]) for one in table] == [
        ("random", "-25", "lost"),
        ("shut", "0", "40"),
        ("law", "50", "2"),
        ("best", "100", "0.5"),
    ]
    assert (table[1]["success, %"], table[1]["lost, %"], table[1]["return at 0.9"]) == ("25", "50", "9")
