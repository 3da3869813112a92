// The list of components that have a compiled twin: the kind of each, and the struct that is it.
#pragma once

#define VEDETTE_SENSORS(sensor)                            \
    sensor(bearing_only, BearingOnly)                      \
    sensor(polar_position, PolarPosition)                  \
    sensor(range_bearing, RangeBearing)                    \
    sensor(range_bearing_elevation, RangeBearingElevation) \
    sensor(range_bearing_rate, RangeBearingRate)           \
    sensor(range_only, RangeOnly)

#define VEDETTE_MOTIONS(motion)                                  \
    motion(coordinated_turn, CoordinatedTurn)                    \
    motion(coordinated_turn_3d, CoordinatedTurn3d)               \
    motion(coordinated_turn_piecewise, CoordinatedTurnPiecewise) \
    motion(curvilinear, Curvilinear)

namespace vedette {

// As the kernels of vedette call them: core/cpp/twins.hpp.
struct Twins {
#define VEDETTE_SENSOR(kind, Kind) \
    void (*kind)(int, const double*, const double*, double*, double*, double*, double*, void*);
#define VEDETTE_MOTION(kind, Kind) \
    void (*kind)(int, double, const double*, const double*, double*, double*, double*, void*);
    VEDETTE_SENSORS(VEDETTE_SENSOR) VEDETTE_MOTIONS(VEDETTE_MOTION)
#undef VEDETTE_SENSOR
#undef VEDETTE_MOTION
};

}  // namespace vedette
