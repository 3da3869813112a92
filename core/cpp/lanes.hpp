// One track, or eight side by side: the kernels are written once over a number type that is either.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

#include "shapes.hpp"

// Compiled once for each instruction set, each time in a namespace of its own, so that the linker cannot mix them.
namespace vedette::VEDETTE_ISA {

typedef double Eight __attribute__((vector_size(8 * kLanes)));
typedef long long Eight64 __attribute__((vector_size(8 * kLanes)));

inline Eight64 bits(Eight value) { return reinterpret_cast<Eight64>(value); }
inline Eight number(Eight64 value) { return reinterpret_cast<Eight>(value); }

constexpr double kLn2High = 0x1.62e42fee00000p-1, kLn2Low = 0x1.a39ef35793c76p-33;  // the first has 21 zero bits at its end
constexpr double kToWhole = 0x1.8p52;  // adding it rounds to a whole number, which then stands in the lowest bits

// exp to two units in the last place: 2^w e^r with |r| <= ln(2)/2, e^r by its series to the 13th power. Written for vectors, as
// a call of the library's for each of the eight would be most of a kernel's time.
inline Eight exp_of(Eight x) {
    x = x > 710.0 ? 710.0 - (Eight){} : x;
    x = x < -746.0 ? -746.0 - (Eight){} : x;
    const Eight shifted = x * 1.4426950408889634 + kToWhole, whole = shifted - kToWhole;
    const Eight r = (x - whole * kLn2High) - whole * kLn2Low;
    constexpr double series[] = {1.0 / 6227020800, 1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880,
                                 1.0 / 40320, 1.0 / 5040, 1.0 / 720, 1.0 / 120, 1.0 / 24, 1.0 / 6, 0.5, 1.0, 1.0};
    Eight sum = series[0] - (Eight){};
    for (int i = 1; i < 14; ++i) sum = sum * r + series[i];
    // 2^w in two factors, so that results below the normal numbers come out too.
    const Eight64 w = bits(shifted) - bits(kToWhole - (Eight){}), half = w >> 1;
    return sum * number((half + 1023) << 52) * number((w - half + 1023) << 52);
}

// log to two units in the last place, of normal numbers: x = 2^e m, log m = 2 artanh((m-1)/(m+1)) with 1/sqrt(2) <= m < sqrt(2).
inline Eight log_of(Eight x) {
    const Eight64 shifted = bits(x) - 0x3fe6a09e667f3bcdLL, e = shifted >> 52;
    const Eight m = number(bits(x) - (e << 52)), t = (m - 1.0) / (m + 1.0), square = t * t;
    Eight sum = 1.0 / 23 - (Eight){};
    for (int i = 21; i > 0; i -= 2) sum = sum * square + 1.0 / i;
    const Eight whole = number(e + bits(kToWhole - (Eight){})) - kToWhole;
    return whole * kLn2High + (whole * kLn2Low + 2.0 * t * sum);
}

template <class T>
struct Lane;

template <>
struct Lane<double> {
    static constexpr int count = 1;
    static double load(In a, std::ptrdiff_t i) { return a.at[i]; }
    static void store(Out a, std::ptrdiff_t i, double value) { a.at[i] = value; }
    static double all(double value) { return value; }
    static double log(double value) { return std::log(value); }
    static double exp(double value) { return std::exp(value); }
    static double sqrt(double value) { return std::sqrt(value); }
    static double larger(double a, double b) { return a > b ? a : b; }
    static double wrap(double x, double period) {
        const double half = period / 2, near = x - period * std::nearbyint(x / period);
        return near < half ? larger(near, -half) : -half;
    }
};

template <>
struct Lane<Eight> {
    static constexpr int count = kLanes;
    static Eight load(In a, std::ptrdiff_t i) {
        const double* p = a.at + i;
        const std::ptrdiff_t s = a.next;
        if (s == 0) return all(*p);
        return Eight{p[0], p[s], p[2 * s], p[3 * s], p[4 * s], p[5 * s], p[6 * s], p[7 * s]};
    }
    static void store(Out a, std::ptrdiff_t i, Eight value) {
        for (int l = 0; l < kLanes; ++l) a.at[l * a.next + i] = value[l];
    }
    static Eight all(double value) { return Eight{value, value, value, value, value, value, value, value}; }
    template <class F>
    static Eight each(Eight value, F f) {
        for (int l = 0; l < kLanes; ++l) value[l] = f(value[l]);
        return value;
    }
    static Eight log(Eight value) {
        constexpr double least = std::numeric_limits<double>::min(), most = std::numeric_limits<double>::max();
        const Eight64 usual = ((value >= least) & (value <= most)) | (value == 0.0);
        for (int l = 0; l < kLanes; ++l)
            if (!usual[l]) return each(value, [](double v) { return std::log(v); });
        return value == 0.0 ? all(-std::numeric_limits<double>::infinity()) : log_of(value);
    }
    static Eight exp(Eight value) { return exp_of(value); }
    static Eight sqrt(Eight value) {
        return each(value, [](double v) { return std::sqrt(v); });
    }
    static Eight larger(Eight a, Eight b) { return a > b ? a : b; }
    static Eight wrap(Eight x, double period) {
        return each(x, [period](double v) { return Lane<double>::wrap(v, period); });
    }
};

}  // namespace vedette::VEDETTE_ISA
