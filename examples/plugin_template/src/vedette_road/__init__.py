"""Vehicles that enter and drive along a road, watched by a radar and by pairs of receivers."""

import vedette
from vedette_road.cheap_jpda import CheapJPDA
from vedette_road.clothoid import Clothoid
from vedette_road.entrances import Entrances
from vedette_road.in_a_row import InARow
from vedette_road.second_order import SecondOrder
from vedette_road.time_difference import TimeDifference

VEDETTE_CONTRACT = 2


@vedette.plugin
def vedette_components():
    return [Clothoid, TimeDifference, CheapJPDA, InARow, Entrances, SecondOrder]
