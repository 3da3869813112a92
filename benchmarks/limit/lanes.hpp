// Vectors of doubles by GCC's vector extension (any processor), and the functions that filters need of them.
#pragma once
#include <cmath>
#include <cstdint>
#include <cstring>

typedef double V4 __attribute__((vector_size(32)));
typedef double V8 __attribute__((vector_size(64)));

template <class V> struct Bits;
template <> struct Bits<V4> { typedef int64_t type __attribute__((vector_size(32))); };
template <> struct Bits<V8> { typedef int64_t type __attribute__((vector_size(64))); };

template <class V> inline V lesser(V a, V b) { return a < b ? a : b; }
template <class V> inline V greater(V a, V b) { return a > b ? a : b; }

template <class V> inline V root(V x) {
    for (unsigned lane = 0; lane < sizeof(V) / sizeof(double); lane++) x[lane] = std::sqrt(x[lane]);  // one instruction
    return x;
}

template <class To, class From> inline To same_bits(From from) {
    static_assert(sizeof(To) == sizeof(From), "the same number of bits");
    To to;
    std::memcpy(&to, &from, sizeof to);
    return to;
}

// e^x for x <= 700, to 2e-16 of itself; from -700 downwards that of -700.
template <class V> inline V exponential(V x) {
    typedef typename Bits<V>::type I;
    const double shifter = 6755399441055744.0;  // 1.5 * 2^52: rounds, and leaves the integer in the lowest bits
    x = greater(x, V{} - 700.0);
    V shifted = x * 1.4426950408889634 + shifter;
    V k = shifted - shifter;
    V t = (x - k * 0.693147180369123816490) - k * 1.90821492927058770002e-10;
    V p = V{} + 1.0 / 6227020800.0;
    const double taylor[] = {1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0, 1.0 / 362880.0, 1.0 / 40320.0,
                             1.0 / 5040.0,      1.0 / 720.0,      1.0 / 120.0,     1.0 / 24.0,     1.0 / 6.0,
                             0.5,               1.0,              1.0};
    for (double c : taylor) p = p * t + c;
    return same_bits<V>(same_bits<I>(p) + (same_bits<I>(shifted) << 52));
}

// The natural logarithm of normal x > 0.
template <class V> inline V logarithm(V x) {
    typedef typename Bits<V>::type I;
    I bits = same_bits<I>(x);
    I k = (bits - 0x3fe6a09e667f3bcdLL) >> 52;  // so that the mantissa lies in [sqrt 1/2, sqrt 2)
    V m = same_bits<V>(bits - (k << 52));
    V s = (m - 1.0) / (m + 1.0), q = s * s;
    V p = V{} + 1.0 / 21.0;
    for (int odd = 19; odd > 0; odd -= 2) p = p * q + 1.0 / odd;
    return __builtin_convertvector(k, V) * 0.6931471805599453 + 2.0 * s * p;
}

// The angle of (x, y) in [-pi, pi], not both 0: t = tan of it or, beyond pi/8, of it less pi/4; (atan(t) / t - 1) / t^2 by the
// polynomial in t^2 of least greatest error, 3e-17.
template <class V> inline V angle(V y, V x) {
    typedef typename Bits<V>::type I;
    const I negative = I{} + INT64_MIN;
    V a = same_bits<V>(same_bits<I>(x) & ~negative), b = same_bits<V>(same_bits<I>(y) & ~negative);
    V most = greater(a, b), least = lesser(a, b);
    I steep = least > 0.41421356237309503 * most;
    V t = (steep ? least - most : least) / (steep ? least + most : most), u = t * t, p = V{} - 0.01917688711896928;
    const double fitted[] = {0.03923165829550329,  -0.050854497379370145, 0.05858148912801507, -0.06664511447381855,
                             0.07692183190826078,  -0.09090904578123901,  0.11111111015256361, -0.14285714284666542,
                             0.1999999999999552,   -0.3333333333333333};
    for (double c : fitted) p = p * u + c;
    V found = t + t * u * p;
    found = steep ? found + 0.7853981633974483 : found;
    found = b > a ? 1.5707963267948966 - found : found;
    found = x < 0.0 ? 3.141592653589793 - found : found;
    return same_bits<V>(same_bits<I>(found) | (same_bits<I>(y) & negative));
}
