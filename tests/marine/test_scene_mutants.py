"""Wrong simulators are caught: each mutant fails the test that states the law it breaks."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from vedette_sim import ais, marine_hull, marine_synthesis, sea
from vedette_sim import ppi_display as display
from vedette_sim.marine_synthesis import World
from vedette_sim.polar_fields import TextureMemory, Upsampling
from vedette_sim.ppi import PpiRadar
from vedette_sim.sea import SeaClutter


def module_of(name):
    """The test module of this name, imported by its path."""
    spec = importlib.util.spec_from_file_location(f"mutated_{name}", Path(__file__).parent / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


PICTURES, SEA, AIS = module_of("test_scene"), module_of("test_sea"), module_of("test_scene_ais")

_strength, _turned, _at, _spread = PpiRadar.strength, display.turned, TextureMemory.at, PpiRadar.spread
_nominal, _path, _hull = ais.nominal_intervals, ais.antenna_path, marine_hull.hull

OTHER, ONE_FOR_ALL = sea.texture_table(2.5), np.random.default_rng(1)

MUTANTS = {
    "an untextured sea": (
        SeaClutter, "texture", lambda self, g: np.ones_like(g), SEA.test_the_sea_is_k_distributed, (0.7,)
    ),
    "a texture of another shape": (
        SeaClutter, "texture", lambda self, g: OTHER.take(np.clip((g + 6) / 12 * 4095, 0, 4095).astype(int)),
        SEA.test_the_sea_is_k_distributed, (2.0,),
    ),
    "a texture that lives half as long": (
        TextureMemory, "at", lambda self, turn: _at(self, 2 * turn),
        SEA.test_the_texture_is_correlated_in_time_as_stated, (),
    ),
    "interpolated noise without its scale": (
        Upsampling, "__call__", lambda self, noise: self._smooth(self._smooth(noise, down=False), down=True),
        SEA.test_the_texture_s_field_has_variance_one_everywhere, (),
    ),
    "a beam wider by a tenth": (
        PpiRadar, "spread", property(lambda self: (1.1 * _spread.fget(self)[0], _spread.fget(self)[1])),
        PICTURES.test_a_point_s_echo_is_as_wide_as_beam_and_pulse, (),
    ),
    "an echo by the cube of range": (
        PpiRadar, "strength", lambda self, ranges: _strength(self, ranges) * ranges / 1000.0,
        PICTURES.test_a_point_s_echo_is_as_wide_as_beam_and_pulse, (),
    ),
    "a picture turned by five sweeps": (
        display, "turned", lambda levels, bearings: np.roll(_turned(levels, bearings), 5, axis=0),
        PICTURES.test_an_echo_is_where_the_geometry_says, ("north-up", (280.0, -350.0), np.radians(-200.0)),
    ),
    "bearings counter-clockwise": (
        display, "turned", lambda levels, bearings: _turned(levels, bearings)[::-1],
        PICTURES.test_an_echo_is_where_the_geometry_says, ("head-up", (310.0, 205.0), np.pi / 2),
    ),
    "a heading counted from east": (
        World, "bow", lambda self, times: self.ownship.heading(times),
        PICTURES.test_an_echo_is_where_the_geometry_says, ("north-up", (310.0, 205.0), np.radians(-200.0)),
    ),
    "all azimuths at one time": (
        World, "sighted", lambda self, turn, where: (turn * self.radar.period, 0.0, where(turn * self.radar.period)),
        PICTURES.test_each_azimuth_is_seen_at_its_own_time_also_from_a_turning_ship, (),
    ),
    "randomness from the order of asking": (
        marine_synthesis, "own_stream", lambda seed, *key: ONE_FOR_ALL,
        PICTURES.test_the_seed_decides_whatever_the_order_and_the_process, (),
    ),
    "a hull seen through": (
        marine_hull, "hull", lambda *size: tuple(p * s for p, s in zip(_hull(*size), (1, -1, 1), strict=True)),
        PICTURES.test_a_vessel_s_mean_echo_is_its_cross_section_and_comes_from_its_near_side, (),
    ),
    "class A with the intervals of class B": (
        AIS, "nominal_intervals", lambda carriage, *given, **more: _nominal("B", *given, **more),
        AIS.test_intervals_are_those_of_the_recommendation, ("A", 14.1, 6.0, 2.0),
    ),
    "an antenna to starboard": (
        AIS, "antenna_path", lambda path, antenna, times: _path(path, np.asarray(antenna) * [1, -1], times),
        AIS.test_an_antenna_aft_and_to_port, (),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MUTANTS)
@pytest.mark.costly
def test_a_mutant_is_caught(name, monkeypatch):
    owner, attribute, mutant, law, given = MUTANTS[name]
    law(*given)
    monkeypatch.setattr(owner, attribute, mutant)
    with pytest.raises(AssertionError):
        law(*given)
