// One track, or eight side by side: the kernels are written once over a number type that is either.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <type_traits>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include "kernels.hpp"

// Compiled once for each instruction set, each time in a namespace of its own, so that the linker cannot mix them.
namespace vedette::VEDETTE_ISA {

typedef double Eight __attribute__((vector_size(8 * kLanes)));
typedef long long Eight64 __attribute__((vector_size(8 * kLanes)));
typedef unsigned long long EightWords __attribute__((vector_size(8 * kLanes)));

typedef double Row __attribute__((vector_size(8 * 4)));
typedef long long Row64 __attribute__((vector_size(8 * 4)));

#define VEDETTE_INLINED __attribute__((always_inline))
#define VEDETTE_INLINE VEDETTE_INLINED inline
#ifdef __clang__
#define VEDETTE_SHUFFLE(whole, a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define VEDETTE_SHUFFLE(whole, a, b, ...) __builtin_shuffle(a, b, whole{__VA_ARGS__})
#endif

VEDETTE_INLINE Row load_row(const double* at) {
    Row row;
    std::memcpy(&row, at, sizeof row);
    return row;
}
VEDETTE_INLINE void store_row(double* at, Row row) { std::memcpy(at, &row, sizeof row); }

// Rows of a matrix into its columns.
VEDETTE_INLINE void transpose(Row* a) {
    const Row p = VEDETTE_SHUFFLE(Row64, a[0], a[1], 0, 4, 2, 6), q = VEDETTE_SHUFFLE(Row64, a[0], a[1], 1, 5, 3, 7);
    const Row s = VEDETTE_SHUFFLE(Row64, a[2], a[3], 0, 4, 2, 6), t = VEDETTE_SHUFFLE(Row64, a[2], a[3], 1, 5, 3, 7);
    a[0] = VEDETTE_SHUFFLE(Row64, p, s, 0, 1, 4, 5), a[1] = VEDETTE_SHUFFLE(Row64, q, t, 0, 1, 4, 5);
    a[2] = VEDETTE_SHUFFLE(Row64, p, s, 2, 3, 6, 7), a[3] = VEDETTE_SHUFFLE(Row64, q, t, 2, 3, 6, 7);
}

// Eight tracks' rows of four, tracks i and i + 4 side by side, from and to memory; and each half's rows into its columns.
#ifdef __AVX512F__
VEDETTE_INLINE Eight load_pair(const double* first, const double* second) {
    return _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(first)), _mm256_loadu_pd(second), 1);
}
VEDETTE_INLINE void store_pair(double* first, double* second, Eight pair) {
    _mm256_storeu_pd(first, _mm512_castpd512_pd256(pair));
    _mm256_storeu_pd(second, _mm512_extractf64x4_pd(pair, 1));
}
VEDETTE_INLINE void transpose(Eight* a) {
#define VEDETTE_EVEN 0, 8, 2, 10, 4, 12, 6, 14
#define VEDETTE_ODD 1, 9, 3, 11, 5, 13, 7, 15
#define VEDETTE_FRONT 0, 1, 8, 9, 4, 5, 12, 13
#define VEDETTE_BACK 2, 3, 10, 11, 6, 7, 14, 15
    const Eight p = VEDETTE_SHUFFLE(Eight64, a[0], a[1], VEDETTE_EVEN), q = VEDETTE_SHUFFLE(Eight64, a[0], a[1], VEDETTE_ODD);
    const Eight s = VEDETTE_SHUFFLE(Eight64, a[2], a[3], VEDETTE_EVEN), t = VEDETTE_SHUFFLE(Eight64, a[2], a[3], VEDETTE_ODD);
    a[0] = VEDETTE_SHUFFLE(Eight64, p, s, VEDETTE_FRONT), a[1] = VEDETTE_SHUFFLE(Eight64, q, t, VEDETTE_FRONT);
    a[2] = VEDETTE_SHUFFLE(Eight64, p, s, VEDETTE_BACK), a[3] = VEDETTE_SHUFFLE(Eight64, q, t, VEDETTE_BACK);
}
#else
VEDETTE_INLINE Eight load_pair(const double* first, const double* second) {
    Eight pair;
    std::memcpy(&pair, first, sizeof(Row));
    std::memcpy(reinterpret_cast<char*>(&pair) + sizeof(Row), second, sizeof(Row));
    return pair;
}
VEDETTE_INLINE void store_pair(double* first, double* second, Eight pair) {
    std::memcpy(first, &pair, sizeof(Row));
    std::memcpy(second, reinterpret_cast<const char*>(&pair) + sizeof(Row), sizeof(Row));
}
VEDETTE_INLINE void transpose(Eight* a) {
    Row half[2][4];
    for (int i = 0; i < 4; ++i) store_pair(reinterpret_cast<double*>(&half[0][i]), reinterpret_cast<double*>(&half[1][i]), a[i]);
    transpose(half[0]), transpose(half[1]);
    for (int i = 0; i < 4; ++i)
        a[i] = load_pair(reinterpret_cast<const double*>(&half[0][i]), reinterpret_cast<const double*>(&half[1][i]));
}
#endif
#ifdef __AVX__
constexpr bool kTransposesRows = true;
#else
constexpr bool kTransposesRows = false;  // without vectors of four, numbers are gathered one by one
#endif

// The bits of numbers, and back; `words` may be shifted to the left whatever they hold.
template <class T>
struct Bits;
template <>
struct Bits<double> {
    typedef long long type;
    typedef unsigned long long words;
};
template <>
struct Bits<Eight> {
    typedef Eight64 type;
    typedef EightWords words;
};
template <class To, class From>
VEDETTE_INLINE To bits_as(From from) {
    To to;
    std::memcpy(&to, &from, sizeof to);
    return to;
}

VEDETTE_INLINE bool all_of(long long which) { return which != 0; }
VEDETTE_INLINE bool all_of(Eight64 which) {
#ifdef __AVX512F__
    return _mm512_movepi64_mask(reinterpret_cast<__m512i>(which)) == 0xff;
#else
    long long every = which[0];
    for (int l = 1; l < kLanes; ++l) every &= which[l];
    return every != 0;
#endif
}

constexpr double kTiny = std::numeric_limits<double>::min();  // the smallest normal number
constexpr double kLeastExponent = -708.3964185322641;        // its logarithm

// A weight, or 0 for one below the smallest normal number, as arithmetic on such is many times slower.
template <class T>
VEDETTE_INLINE T normal_or_zero(T weight) {
    return weight < kTiny ? T{} : weight;
}

constexpr double kLn2High = 0x1.62e42fee00000p-1, kLn2Low = 0x1.a39ef35793c76p-33;  // the first has 21 zero bits at its end
constexpr double kToWhole = 0x1.8p52;  // adding it rounds to a whole number, which then stands in the lowest bits

// x 2^w, with w in the lowest bits of `shifted`.
template <class T>
VEDETTE_INLINE T scale_by_power(T x, T shifted) {
#ifdef __AVX512F__
    const T whole = shifted - kToWhole;
    if constexpr (std::is_same_v<T, Eight>)
        return _mm512_scalef_pd(x, whole);
    else
        return _mm_cvtsd_f64(_mm_scalef_sd(_mm_set_sd(x), _mm_set_sd(whole)));
#else
    typedef typename Bits<T>::type I;
    typedef typename Bits<T>::words W;
    const I w = bits_as<I>(shifted) - bits_as<I>(kToWhole - T{}), half = w >> 1;  // two factors: results may be subnormal
    return x * bits_as<T>(W(bits_as<W>(I(half + 1023)) << 52)) * bits_as<T>(W(bits_as<W>(I(w - half + 1023)) << 52));
#endif
}

// exp to two units in the last place, 0 where it would be no normal number: 2^w e^r with |r| <= ln(2)/2. For e^r the polynomial
// through Chebyshev's nodes, off by 2e-17, its even and odd powers apart, as then half as many steps wait for another. Written
// out, as a call of the library's for each of eight would be most of a kernel's time, and for one it would keep all else waiting.
template <class T>
VEDETTE_INLINE T exp_of(T x) {
    x = x > 710.0 ? 710.0 - T{} : x;
    const auto vanishes = x < kLeastExponent;
    x = vanishes ? T{} : x;
    const T shifted = x * 1.4426950408889634 + kToWhole, whole = shifted - kToWhole;
    const T r = (x - whole * kLn2High) - whole * kLn2Low, square = r * r;
    T even = 0x1.28b40581fba5cp-22 - T{}, odd = 0x1.af631d03b18bfp-26 - T{};
    for (double c : {0x1.a01991ac8440bp-16, 0x1.6c16c187fbe13p-10, 0x1.555555554f0cep-5, 0x1.0000000000011p-1, 1.0})
        even = even * square + c;
    for (double c : {0x1.71ddf5749b43dp-19, 0x1.a01a01b14379ap-13, 0x1.111111110f225p-7, 0x1.555555555555ap-3, 1.0})
        odd = odd * square + c;
    return vanishes ? T{} : scale_by_power(odd * r + even, shifted);
}

// log to two units in the last place, of normal numbers: x = 2^e m, 1/sqrt(2) <= m < sqrt(2), log m = 2 artanh((m-1)/(m+1)), for
// which again a polynomial through Chebyshev's nodes, off by 5e-18.
template <class T>
VEDETTE_INLINE T log_of_normal(T x) {
    typedef typename Bits<T>::type I;
    typedef typename Bits<T>::words W;
    const I shifted = bits_as<I>(x) - 0x3fe6a09e667f3bcdLL, e = shifted >> 52;
    const T m = bits_as<T>(W(bits_as<W>(x) - (bits_as<W>(e) << 52))), t = (m - 1.0) / (m + 1.0), square = t * t;
    T even = 0.07665860794787153 - T{}, odd = 0.07308224910391238 - T{};  // apart, as in exp_of
    const T fourth = square * square;
    for (double c : {0.11111105567395273, 0.19999999999949752, 1.0}) even = even * fourth + c;
    for (double c : {0.0909144456279605, 0.14285714312987757, 0.3333333333333335}) odd = odd * fourth + c;
    const T sum = odd * square + even;
    const T whole = bits_as<T>(I(e + bits_as<I>(kToWhole - T{}))) - kToWhole;
    return whole * kLn2High + (whole * kLn2Low + 2.0 * t * sum);
}

template <class T>
VEDETTE_INLINE bool is_zero_or_normal(T x) {  // for log_of
    constexpr double least = std::numeric_limits<double>::min(), most = std::numeric_limits<double>::max();
    return all_of(((x >= least) & (x <= most)) | (x == 0.0));
}

template <class T>
VEDETTE_INLINE T log_of(T x) {
    return x == 0.0 ? T{} - std::numeric_limits<double>::infinity() : log_of_normal(x);
}

template <class T>
struct Lane;

template <>
struct Lane<double> {
    static constexpr int count = 1;
    static double load(const In& a, std::ptrdiff_t i) { return a.at[i]; }
    static void store(const Out& a, std::ptrdiff_t i, double value) { a.at[i] = value; }
    static double broadcast(double value) { return value; }
    static double log(double value) { return is_zero_or_normal(value) ? log_of(value) : std::log(value); }
    static double exp(double value) { return exp_of(value); }
    static double sqrt(double value) { return std::sqrt(value); }
    static double maximum(double a, double b) { return a <= b ? b : a; }  // a where it is NaN
    static double wrap(double x, double period) {
        const double half = period / 2, near = x - period * std::nearbyint(x * (1.0 / period));
        return near >= half ? -half : maximum(near, -half);
    }
};

template <>
struct Lane<Eight> {
    static constexpr int count = kLanes;
    static Eight load(const In& a, std::ptrdiff_t i) {
        const double* p = a.at + i;
        const std::ptrdiff_t s = a.next;
        if (s == 0) return broadcast(*p);
        if (s == 1) {
            Eight eight;
            std::memcpy(&eight, p, sizeof eight);
            return eight;
        }
        return Eight{p[0], p[s], p[2 * s], p[3 * s], p[4 * s], p[5 * s], p[6 * s], p[7 * s]};
    }
    static void store(const Out& a, std::ptrdiff_t i, Eight value) {
        if (a.next == 1) {
            std::memcpy(a.at + i, &value, sizeof value);
            return;
        }
        for (int l = 0; l < kLanes; ++l) a.at[l * a.next + i] = value[l];
    }
    static Eight broadcast(double value) { return Eight{value, value, value, value, value, value, value, value}; }
    template <class F>
    static Eight each(Eight value, F f) {
        for (int l = 0; l < kLanes; ++l) value[l] = f(value[l]);
        return value;
    }
    static Eight log(Eight value) {
        return is_zero_or_normal(value) ? log_of(value) : each_log(value);
    }
    __attribute__((noinline, cold)) static Eight each_log(Eight value) {
        return each(value, [](double v) { return std::log(v); });
    }
    static Eight exp(Eight value) { return exp_of(value); }
    static Eight sqrt(Eight value) {
        return each(value, [](double v) { return std::sqrt(v); });
    }
    static Eight maximum(Eight a, Eight b) { return a <= b ? b : a; }
    static Eight wrap(Eight x, double period) {
        const double half = period / 2;
        const Eight turns = (x * (1.0 / period) + kToWhole) - kToWhole, near = x - period * turns;
        return near >= half ? -half - Eight{} : maximum(near, -half - Eight{});
    }
};

// A stage that stands apart.
template <class F>
__attribute__((noinline)) void outlined(const F& f) {
    f();
}

// Sizes are constants where loops over them are to be unrolled, and so is the product of two.
template <int a, int b>
constexpr std::integral_constant<int, a * b> operator*(std::integral_constant<int, a>, std::integral_constant<int, b>) {
    return {};
}

// Loops over sizes that are no constants are compiled once, not wherever they are called.
template <class... N, class F>
VEDETTE_INLINE void once_unless_constant(const F& f) {
    if constexpr ((std::is_same_v<N, int> && ...))
        outlined(f);
    else
        f();
}

// By rows of four: a wider load must wait until two narrower stores have reached the cache.
VEDETTE_INLINE void copy(const double* from, double* to, int count) {
    int i = 0;
    for (; i + 4 <= count; i += 4) store_row(to + i, load_row(from + i));
    for (; i < count; ++i) to[i] = from[i];
}

VEDETTE_INLINE In at_offset(const In& a, std::ptrdiff_t from) { return {a.at + from, a.next}; }
VEDETTE_INLINE Out at_offset(const Out& a, std::ptrdiff_t from) { return {a.at + from, a.next}; }

// Of a problem's `count` numbers those that `want` says.
template <class T, class F>
VEDETTE_INLINE void load_where(const In& a, T* to, int count, const F& want) {
#ifdef __AVX512F__
    if constexpr (std::is_same_v<T, Eight>)
        if (count == 2 && a.next == 2) {  // pairs, one after another
            const Eight front = Lane<Eight>::load({a.at, 1}, 0), back = Lane<Eight>::load({a.at + kLanes, 1}, 0);
            to[0] = VEDETTE_SHUFFLE(Eight64, front, back, 0, 2, 4, 6, 8, 10, 12, 14);
            to[1] = VEDETTE_SHUFFLE(Eight64, front, back, 1, 3, 5, 7, 9, 11, 13, 15);
            return;
        }
#endif
    if constexpr (kTransposesRows && std::is_same_v<T, Eight>)
        if (a.next != 0 && count >= 4) {
            for (int i = 0; i < count; i += 4) {
                if (i > count - 4) i = count - 4;  // the last four, some of them once more
                const double* p = a.at + i;
                Eight four[4];
                for (int l = 0; l < 4; ++l) four[l] = load_pair(p + l * a.next, p + (l + 4) * a.next);
                transpose(four);
                for (int l = 0; l < 4; ++l)
                    if (want(i + l)) to[i + l] = four[l];
            }
            return;
        }
    for (int i = 0; i < count; ++i)
        if (want(i)) to[i] = Lane<T>::load(a, i);
}

template <class T, class N>
VEDETTE_INLINE void load(const In& a, T* to, N count) {
    if constexpr (std::is_same_v<T, double>)
        copy(a.at, to, count);
    else
        once_unless_constant<N>([=]() VEDETTE_INLINED { load_where(a, to, count, [](int) { return true; }); });
}

// Number i is what `value` says.
template <class F>
VEDETTE_INLINE void store_each(const Out& a, int count, const F& value) {
#ifdef __AVX512F__
    if (count == 2 && a.next == 2) {
        const Eight first = value(0), second = value(1);
        Lane<Eight>::store({a.at, 1}, 0, VEDETTE_SHUFFLE(Eight64, first, second, 0, 8, 1, 9, 2, 10, 3, 11));
        Lane<Eight>::store({a.at + kLanes, 1}, 0, VEDETTE_SHUFFLE(Eight64, first, second, 4, 12, 5, 13, 6, 14, 7, 15));
        return;
    }
#endif
    if constexpr (kTransposesRows)
        if (count >= 4) {
            for (int i = 0; i < count; i += 4) {
                if (i > count - 4) i = count - 4;
                double* p = a.at + i;
                Eight four[4] = {value(i), value(i + 1), value(i + 2), value(i + 3)};
                transpose(four);
                for (int l = 0; l < 4; ++l) store_pair(p + l * a.next, p + (l + 4) * a.next, four[l]);
            }
            return;
        }
    for (int i = 0; i < count; ++i) Lane<Eight>::store(a, i, value(i));
}

template <class T, class N>
VEDETTE_INLINE void store(const Out& a, const T* from, N count) {
    if constexpr (std::is_same_v<T, double>)
        copy(from, a.at, count);
    else
        once_unless_constant<N>([=]() VEDETTE_INLINED { store_each(a, count, [from](int i) { return from[i]; }); });
}

}  // namespace vedette::VEDETTE_ISA
