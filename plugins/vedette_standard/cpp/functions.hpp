// Functions of angles for eight numbers side by side, to one or two units in the last place. One state goes through them in eight
// copies, so that it gives the same as among others, to the last bit.
#pragma once

#include "lanes.hpp"

namespace vedette::VEDETTE_ISA {

VEDETTE_INLINE Eight root(Eight x) {
#ifdef __AVX512F__
    return _mm512_sqrt_pd(x);
#else
    return Lane<Eight>::sqrt(x);
#endif
}

VEDETTE_INLINE Eight magnitude(Eight x) { return bits_as<Eight>(Eight64(bits_as<Eight64>(x) & 0x7fffffffffffffffLL)); }

constexpr double kPi = 3.141592653589793;

// The value in [-pi, pi), unchanged if it is there.
VEDETTE_INLINE Eight wrapped_angle(Eight x) {
    const Eight turns = (x * (0.5 / kPi) + kToWhole) - kToWhole, near = x - 2 * kPi * turns;
    return near >= kPi ? -kPi - Eight{} : near >= -kPi ? near : -kPi - Eight{};
}

// Of t = tan of the angle or, beyond pi/8 of it, (t - 1) / (t + 1) the odd polynomial through Chebyshev's nodes, off by 3e-18.
VEDETTE_INLINE Eight angle_of(Eight y, Eight x) {
    const Eight a = magnitude(x), b = magnitude(y), most = a >= b ? a : b, least = a >= b ? b : a;
    const Eight64 steep = least > 0.41421356237309503 * most, none = most == 0.0;
    const Eight over = steep ? most + least : (none ? 1.0 - Eight{} : most), t = (steep ? least - most : least) / over;
    const Eight u = t * t;
    const Eight square = u * u;
    Eight even = -0.019175404711104935 - Eight{}, odd = 0.03923044778479309 - Eight{};  // apart, as in exp_of
    for (double c : {-0.050854078345894844, -0.06664510525508936, -0.0909090457530649, -0.14285714284665682, -0.3333333333333333})
        even = even * square + c;
    for (double c : {0.05858140904866328, 0.07692183125376892, 0.11111111015187018, 0.19999999999995516}) odd = odd * square + c;
    const Eight sum = odd * u + even;
    Eight angle = t + t * u * sum;
    angle = steep ? angle + kPi / 4 : angle;
    angle = b > a ? kPi / 2 - angle : angle;
    angle = bits_as<Eight64>(x) < 0 ? kPi - angle : angle;
    return bits_as<Eight>(Eight64(bits_as<Eight64>(angle) | (bits_as<Eight64>(y) & (-0x7fffffffffffffffLL - 1))));
}

__attribute__((noinline, cold)) inline void sine_and_cosine_of_each(Eight x, Eight& sine, Eight& cosine) {
    for (int l = 0; l < kLanes; ++l) sine[l] = std::sin(x[l]), cosine[l] = std::cos(x[l]);
}

// The quarter turns are taken off with pi/2 in three parts, of which two have zero bits at their end.
VEDETTE_INLINE void sine_and_cosine(Eight x, Eight& sine, Eight& cosine) {
    if (!all_of(magnitude(x) < 1e5)) return sine_and_cosine_of_each(x, sine, cosine);
    const Eight shifted = x * 0.6366197723675814 + kToWhole, quarters = shifted - kToWhole;
    const Eight r = ((x - quarters * 0x1.921fb54400000p+0) - quarters * 0x1.0b4611a600000p-34) - quarters * 0x1.3198a2e037073p-69;
    const Eight u = r * r;
    Eight odd = 1.5917988979397435e-10 - Eight{}, even = -1.138254464534925e-11 - Eight{};
    for (double c : {-2.5051129896450185e-08, 2.7557316093198404e-06, -0.00019841269836740532, 0.008333333333330936,
                     -0.16666666666666666})
        odd = odd * u + c;
    for (double c : {2.087614504941318e-09, -2.755731726587808e-07, 2.48015872987544e-05, -0.0013888888888887389,
                     0.041666666666666664})
        even = even * u + c;
    const Eight s = r + r * u * odd, c = 1.0 - 0.5 * u + u * u * even;
    const Eight64 which = bits_as<Eight64>(shifted);
    const Eight64 swapped = (which & 1) != 0, lower = (which & 2) != 0, left = ((which + 1) & 2) != 0;
    sine = swapped ? c : s, cosine = swapped ? s : c;
    sine = lower ? -sine : sine, cosine = left ? -cosine : cosine;
}

// Of a row of `count` numbers those from i on, at most eight: the last again beyond the end.
VEDETTE_INLINE Eight take(const double* row, int i, int count) {
    Eight eight;
    if (i + kLanes <= count) {
        std::memcpy(&eight, row + i, sizeof eight);
        return eight;
    }
    for (int l = 0; l < kLanes; ++l) eight[l] = row[i + l < count ? i + l : count - 1];
    return eight;
}
VEDETTE_INLINE void put(Eight eight, double* row, int i, int count) {
    if (i + kLanes <= count) {
        std::memcpy(row + i, &eight, sizeof eight);
        return;
    }
    for (int l = 0; i + l < count; ++l) row[i + l] = eight[l];
}

}  // namespace vedette::VEDETTE_ISA
