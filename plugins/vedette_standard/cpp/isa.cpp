// The twins compiled for one instruction set, which the build names: -DVEDETTE_ISA=baseline, avx2, avx512.

#include "motions.hpp"
#include "sensors.hpp"
#include "twins.hpp"

namespace vedette::VEDETTE_ISA {

namespace {

template <int size>
VEDETTE_INLINE void take_rows(const double* from, Eight* to, int i, int count) {
    for (int a = 0; a < size; ++a) to[a] = take(from + a * count, i, count);
}
template <int size>
VEDETTE_INLINE void put_rows(const Eight* from, double* to, int i, int count) {
    for (int a = 0; a < size; ++a) put(from[a], to + a * count, i, count);
}

template <class Kind>
void look(int count, const double* x, const double* parameters, double* z, double* slope, double* noise, double* detects, void*) {
    constexpr int n = Kind::axes, m = Kind::measured;
    for (int i = 0; i < count; i += kLanes) {
        Eight state[n], own[Kind::parameters], value[m], H[m * n], R[m * m], probability;
        take_rows<n>(x, state, i, count), take_rows<Kind::parameters>(parameters, own, i, count);
        Kind::look({state, own, value, H, R, &probability});
        put_rows<m>(value, z, i, count), put_rows<m * n>(H, slope, i, count), put_rows<m * m>(R, noise, i, count);
        put(probability, detects, i, count);
    }
}

template <class Kind>
void move(int count, double dt, const double* x, const double* parameters, double* moved, double* slope, double* noise, void*) {
    constexpr int n = Kind::axes;
    for (int i = 0; i < count; i += kLanes) {
        Eight state[n], own[Kind::parameters], to[n], F[n * n], Q[n * n];
        take_rows<n>(x, state, i, count), take_rows<Kind::parameters>(parameters, own, i, count);
        Kind::move({dt, state, own, to, F, Q});
        put_rows<n>(to, moved, i, count), put_rows<n * n>(F, slope, i, count), put_rows<n * n>(Q, noise, i, count);
    }
}

}  // namespace

extern const Twins twins;
const Twins twins = {
#define VEDETTE_LOOK(kind, Kind) look<Kind>,
#define VEDETTE_MOVE(kind, Kind) move<Kind>,
    VEDETTE_SENSORS(VEDETTE_LOOK) VEDETTE_MOTIONS(VEDETTE_MOVE)
};

}  // namespace vedette::VEDETTE_ISA
