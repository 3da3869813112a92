// The sensors of this plugin, of eight states side by side: what their classes say in numpy, all of it at once.
//
// A sensor at a position has the parameters x, y, heading, detection probability, least and greatest range, and then its own.
#pragma once

#include "functions.hpp"

namespace vedette::VEDETTE_ISA {

constexpr double kNear = 1e-3;  // m: the distance below which derivatives no longer grow

struct Sensor {
    const Eight *x, *p;
    Eight *z, *H, *R, *detects;
};

struct Sight {
    Eight dx, dy, r, over, nearest, east, north;  // r at least `kNear`, 1 / r, and the unit vector by it

    VEDETTE_INLINE explicit Sight(const Sensor& s) : dx(s.x[0] - s.p[0]), dy(s.x[1] - s.p[1]) {
        nearest = root(dx * dx + dy * dy);
        r = nearest > kNear ? nearest : kNear - Eight{};
        over = 1.0 / r;
        east = dx * over, north = dy * over;
    }
    VEDETTE_INLINE Eight bearing(const Sensor& s) const { return wrapped_angle(angle_of(dy, dx) - s.p[2]); }
};

VEDETTE_INLINE void cover(const Sensor& s, Eight r) {
    *s.detects = ((r >= s.p[4]) & (r <= s.p[5])) ? s.p[3] : Eight{};
}
// Variances, of independent errors.
template <class... V>
VEDETTE_INLINE void scatter(const Sensor& s, V... variances) {
    constexpr int m = sizeof...(V);
    const Eight all[] = {variances...};
    for (int i = 0; i < m * m; ++i) s.R[i] = i % (m + 1) == 0 ? all[i / (m + 1)] : Eight{};
}

// sigma_range^2, sigma_bearing^2, sigma_extent^2
struct RangeBearing {
    static constexpr int axes = 2, measured = 2, parameters = 9;
    VEDETTE_INLINE static void look(const Sensor& s) {
        const Sight sight(s);
        s.z[0] = sight.nearest, s.z[1] = sight.bearing(s);
        s.H[0] = sight.east, s.H[1] = sight.north, s.H[2] = -sight.north * sight.over, s.H[3] = sight.east * sight.over;
        const Eight extent = s.p[8], whole = sight.nearest * sight.nearest + extent;
        if (all_of(extent == 0.0))
            scatter(s, s.p[6], s.p[7]);
        else
            scatter(s, s.p[6] + extent, s.p[7] + (extent > 0.0 ? extent / whole : Eight{}));
        cover(s, sight.nearest);
    }
};

// sigma_bearing^2
struct BearingOnly {
    static constexpr int axes = 2, measured = 1, parameters = 7;
    VEDETTE_INLINE static void look(const Sensor& s) {
        const Sight sight(s);
        s.z[0] = sight.bearing(s);
        s.H[0] = -sight.north * sight.over, s.H[1] = sight.east * sight.over;
        scatter(s, s.p[6]);
        cover(s, sight.nearest);
    }
};

// sigma_range^2
struct RangeOnly {
    static constexpr int axes = 2, measured = 1, parameters = 7;
    VEDETTE_INLINE static void look(const Sensor& s) {
        const Sight sight(s);
        s.z[0] = sight.nearest;
        s.H[0] = sight.east, s.H[1] = sight.north;
        scatter(s, s.p[6]);
        cover(s, sight.nearest);
    }
};

// sigma_range^2, sigma_bearing^2, sigma_rate^2, the platform's velocity
struct RangeBearingRate {
    static constexpr int axes = 4, measured = 3, parameters = 11;
    VEDETTE_INLINE static void look(const Sensor& s) {
        const Sight sight(s);
        const Eight vx = s.x[2] - s.p[9], vy = s.x[3] - s.p[10], rate = sight.east * vx + sight.north * vy;
        const Eight slower = root(sight.east * sight.east + sight.north * sight.north) * sight.over;
        s.z[0] = sight.nearest, s.z[1] = sight.bearing(s), s.z[2] = rate;
        s.H[0] = sight.east, s.H[1] = sight.north, s.H[4] = -sight.north * sight.over, s.H[5] = sight.east * sight.over;
        s.H[8] = (vx - rate * sight.east) * slower, s.H[9] = (vy - rate * sight.north) * slower;
        s.H[2] = s.H[3] = s.H[6] = s.H[7] = Eight{};
        s.H[10] = sight.east, s.H[11] = sight.north;
        scatter(s, s.p[6], s.p[7], s.p[8]);
        cover(s, sight.nearest);
    }
};

// sigma_range^2, sigma_bearing^2, sigma_elevation^2, the radar's height
struct RangeBearingElevation {
    static constexpr int axes = 3, measured = 3, parameters = 10;
    VEDETTE_INLINE static void look(const Sensor& s) {
        const Sight sight(s);
        const Eight dz = s.x[2] - s.p[9], slant = root(sight.nearest * sight.nearest + dz * dz);
        const Eight r = slant > kNear ? slant : kNear - Eight{}, square = r * r;
        s.z[0] = slant, s.z[1] = sight.bearing(s), s.z[2] = wrapped_angle(angle_of(dz, sight.nearest));
        s.H[0] = sight.dx / r, s.H[1] = sight.dy / r, s.H[2] = dz / r;
        s.H[3] = -sight.north * sight.over, s.H[4] = sight.east * sight.over, s.H[5] = Eight{};
        s.H[6] = -sight.east * dz / square, s.H[7] = -sight.north * dz / square, s.H[8] = sight.nearest / square;
        scatter(s, s.p[6], s.p[7], s.p[8]);
        cover(s, slant);
    }
};

// sigma_range^2, sigma_bearing^2, sigma_extent^2
struct PolarPosition {
    static constexpr int axes = 2, measured = 2, parameters = 9;
    static constexpr double kFades = 1e-6, kRounding = 1e-14;  // m, and a part of the noise: as the class has them
    VEDETTE_INLINE static void look(const Sensor& s) {
        const Eight dx = s.x[0] - s.p[0], dy = s.x[1] - s.p[1], distance = dx * dx + dy * dy;
        const Eight xx = dx * dx + 0.5 * kFades * kFades, yy = dy * dy + 0.5 * kFades * kFades, square = distance + kFades * kFades;
        const Eight radial = s.p[6], tangential = (square + radial) * s.p[7], least = kRounding * (radial + tangential);
        const Eight along = radial > least ? radial : least, across = tangential > least ? tangential : least;
        s.z[0] = s.x[0], s.z[1] = s.x[1];
        s.H[0] = s.H[3] = 1.0 - Eight{}, s.H[1] = s.H[2] = Eight{};
        s.R[0] = (along * xx + across * yy) / square + s.p[8], s.R[3] = (along * yy + across * xx) / square + s.p[8];
        s.R[1] = s.R[2] = (along - across) * dx * dy / square;
        cover(s, root(distance));
    }
};

}  // namespace vedette::VEDETTE_ISA
