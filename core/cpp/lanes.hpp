// One track, or eight side by side: the kernels are written once over a number type that is either.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

#include "shapes.hpp"

// Compiled once for each instruction set, each time in a namespace of its own, so that the linker cannot mix them.
namespace vedette::VEDETTE_ISA {

typedef double Eight __attribute__((vector_size(8 * kLanes)));

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
        return each(value, [](double v) { return std::log(v); });
    }
    static Eight exp(Eight value) {
        return each(value, [](double v) { return std::exp(v); });
    }
    static Eight sqrt(Eight value) {
        return each(value, [](double v) { return std::sqrt(v); });
    }
    static Eight larger(Eight a, Eight b) { return a > b ? a : b; }
    static Eight wrap(Eight x, double period) {
        return each(x, [period](double v) { return Lane<double>::wrap(v, period); });
    }
};

}  // namespace vedette::VEDETTE_ISA
