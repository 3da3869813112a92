"""The classics of target tracking, one component per file."""

from collections.abc import Iterable

import vedette
from vedette_standard.associators.global_nearest import GlobalNearest
from vedette_standard.associators.jpda import Jpda
from vedette_standard.associators.jpda_star import JpdaStar
from vedette_standard.associators.k_best import KBest
from vedette_standard.associators.lmb import LabelledMultiBernoulli
from vedette_standard.associators.m_best_jpda import MBestJpda
from vedette_standard.associators.n_scan import NScan
from vedette_standard.associators.nearest import Nearest
from vedette_standard.associators.pda import Pda
from vedette_standard.associators.variational import Variational
from vedette_standard.births.from_returns import FromReturns
from vedette_standard.births.given import Given
from vedette_standard.births.poisson import Poisson
from vedette_standard.births.three_point import ThreePoint
from vedette_standard.births.two_point import TwoPoint
from vedette_standard.births.uniform import Uniform
from vedette_standard.estimators.auxiliary import AuxiliaryParticles
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.cubature import CubatureKalman
from vedette_standard.estimators.ensemble import EnsembleKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.fading_memory import FadingMemory
from vedette_standard.estimators.g_h import GH
from vedette_standard.estimators.gaussian_sum import GaussianSum
from vedette_standard.estimators.h_infinity import HInfinity
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.intermittent import Intermittent
from vedette_standard.estimators.iterated import IteratedExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.least_squares import LeastSquares
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.grouping import Labels as Labels
from vedette_standard.grouping import grouped as grouped
from vedette_standard.grouping import linked as linked
from vedette_standard.lifecycles.coast_limited import CoastLimited
from vedette_standard.lifecycles.existence import Existence as Existence
from vedette_standard.lifecycles.m_of_n import MOfN
from vedette_standard.lifecycles.score import Score
from vedette_standard.lifecycles.single_target import SingleTarget as SingleTarget
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.constant_acceleration_piecewise import ConstantAccelerationPiecewise
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.constant_velocity_piecewise import ConstantVelocityPiecewise
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.coordinated_turn_3d import CoordinatedTurn3d
from vedette_standard.motion.coordinated_turn_piecewise import CoordinatedTurnPiecewise
from vedette_standard.motion.curvilinear import Curvilinear
from vedette_standard.motion.gauss_markov import GaussMarkov
from vedette_standard.motion.known_turn import KnownTurn
from vedette_standard.motion.linear import Linear
from vedette_standard.motion.ornstein_uhlenbeck import OrnsteinUhlenbeck
from vedette_standard.motion.product import Product
from vedette_standard.motion.random_walk import RandomWalk
from vedette_standard.motion.random_walk_piecewise import RandomWalkPiecewise
from vedette_standard.motion.singer import Singer
from vedette_standard.motion.wiener_acceleration_piecewise import WienerAccelerationPiecewise
from vedette_standard.permanent import GivenTracks as GivenTracks
from vedette_standard.permanent import PermanentTracks as PermanentTracks
from vedette_standard.preprocessors.debiased_conversion import DebiasedConversion
from vedette_standard.preprocessors.grouped_returns import GroupedReturns as GroupedReturns
from vedette_standard.preprocessors.modified_unbiased_conversion import ModifiedUnbiasedConversion
from vedette_standard.preprocessors.naive_conversion import NaiveConversion
from vedette_standard.preprocessors.unbiased_conversion import UnbiasedConversion
from vedette_standard.sensors.bearing_only import BearingOnly
from vedette_standard.sensors.biased import Biased
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.coarse import Coarse
from vedette_standard.sensors.direct import DirectSensor as DirectSensor
from vedette_standard.sensors.displaced import Displaced
from vedette_standard.sensors.linear import LinearSensor
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.placed import PlacedSensor as PlacedSensor
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_standard.sensors.position_velocity import PositionVelocity
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.range_bearing_elevation import RangeBearingElevation
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate
from vedette_standard.sensors.range_only import RangeOnly
from vedette_standard.sensors.station import stands as stands
from vedette_standard.sensors.view import Detection as Detection

VEDETTE_CONTRACT = 2


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Return every component of this package."""
    return [
        *(ConstantVelocity, ConstantAcceleration, Singer, KnownTurn, CoordinatedTurn),
        *(ConstantVelocityPiecewise, ConstantAccelerationPiecewise, WienerAccelerationPiecewise),
        *(CoordinatedTurnPiecewise, RandomWalkPiecewise),
        *(OrnsteinUhlenbeck, RandomWalk, GaussMarkov, CoordinatedTurn3d, Curvilinear, Product, Linear),
        *(CartesianPosition, RangeBearing, PolarPosition, PositionVelocity),
        *(BearingOnly, RangeOnly, RangeBearingRate, RangeBearingElevation, Biased, Displaced, Coarse, Partial, LinearSensor),
        *(Kalman, ExtendedKalman, UnscentedKalman, Imm, Intermittent),
        *(IteratedExtendedKalman, CubatureKalman, SquareRootKalman, FadingMemory),
        *(HInfinity, GH, LeastSquares, EnsembleKalman),
        *(BootstrapParticles, AuxiliaryParticles, GaussianSum),
        *(Nearest, GlobalNearest, Pda, Jpda, JpdaStar, MBestJpda),
        *(KBest, NScan, LabelledMultiBernoulli, Variational),
        *(NaiveConversion, DebiasedConversion, UnbiasedConversion, ModifiedUnbiasedConversion, GroupedReturns),
        *(FromReturns, TwoPoint, ThreePoint, Given, Poisson, Uniform),
        *(SingleTarget, MOfN, Existence, Score, CoastLimited),
    ]
