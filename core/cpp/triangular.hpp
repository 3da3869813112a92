// Orthogonal triangularisation of small matrices. Its functions are of each file's own, as each may be compiled for another
// instruction set.
#pragma once

#include <algorithm>
#include <cmath>

#include "kernels.hpp"

namespace vedette {

// Rows (p, q), `next` apart, into an upper triangular U in the first q of them, U' U = A' A, by Householder's reflections. The row
// with the largest entry of each column comes first, or large rows would drown the small ones.
static inline void triangularise(double* A, int p, int q, int next) {
    for (int j = 0; j < q && j < p; ++j) {
        int first = j;
        for (int i = j + 1; i < p; ++i)
            if (std::fabs(A[i * next + j]) > std::fabs(A[first * next + j])) first = i;
        if (first != j) std::swap_ranges(A + j * next, A + j * next + q, A + first * next);
        double squares = 0.0;
        for (int i = j; i < p; ++i) squares += A[i * next + j] * A[i * next + j];
        const double end = -std::copysign(std::sqrt(squares), A[j * next + j]), over = end * (A[j * next + j] - end);
        if (over == 0.0) continue;
        A[j * next + j] -= end;
        double steps[kMostMeasured + kMostStates] = {};
        for (int i = j; i < p; ++i)
            for (int c = j + 1; c < q; ++c) steps[c] += A[i * next + j] * A[i * next + c];
        for (int i = j; i < p; ++i) {
            const double factor = A[i * next + j] / over;
            for (int c = j + 1; c < q; ++c) A[i * next + c] += factor * steps[c];
        }
        A[j * next + j] = end;
        for (int i = j + 1; i < p; ++i) A[i * next + j] = 0.0;
    }
}

// Of an upper triangular U with rows of q the n columns from `from` on, transposed.
static inline void transpose_into(const double* U, int q, int from, int n, double* L) {
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) L[i * n + j] = j > i ? 0.0 : U[(from + j) * q + from + i];
}

}  // namespace vedette
