// The update of one problem's covariance by its root, for where digits of any other form would cancel: what square_root.py says
// in numpy. It is rare, so its loops are not unrolled.
#pragma once

#include <algorithm>

#include "algebra.hpp"
#include "triangular.hpp"

namespace vedette::VEDETTE_ISA {

constexpr double kRounding = 1e-15;  // a variance's part that rounding leaves in doubt
constexpr double kLost = 1e-10;      // the least part of a variance that an update by other forms may leave of it
constexpr double kLeastPivot = 1e-13;    // of a covariance, as a part of its variance
constexpr double kMostCancelled = 2e3;   // times a variance: terms of this size leave it 12 digits
constexpr int kMostColumns = kMostMeasured + kMostStates;
constexpr int kMostRows = kMostMeasured + kMostPoints;

VEDETTE_INLINE double lane(double value, int) { return value; }
VEDETTE_INLINE double lane(const Eight& value, int l) { return value[l]; }
VEDETTE_INLINE bool is_set(bool mask, int) { return mask; }
VEDETTE_INLINE bool is_set(const Eight64& mask, int l) { return mask[l] != 0; }
VEDETTE_INLINE void set_lane(double& value, int, double to) { value = to; }
VEDETTE_INLINE void set_lane(Eight& value, int l, double to) { value[l] = to; }

// Rows, the transposed root, of P (n, n), of which the upper triangle is read; a pivot less than rounding leaves of its variance
// is raised to that, and what it says of other axes bounded by what is left of their variances: so P may be singular, or
// indefinite by rounding.
inline void bounded_root(const double* P, double* rows, int n) {
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < j; ++i) rows[j * n + i] = 0.0;
        const double variance = P[j * n + j], least = kRounding * variance;
        double pivot = variance;
        for (int l = 0; l < j; ++l) pivot -= rows[l * n + j] * rows[l * n + j];
        const bool raised = pivot < least;
        if (raised) pivot = least;
        const double over = variance <= 0.0 ? 0.0 : 1.0 / std::sqrt(pivot);
        rows[j * n + j] = pivot * over;
        for (int i = j + 1; i < n; ++i) {
            double sum = P[j * n + i];
            for (int l = 0; l < j; ++l) sum -= rows[l * n + i] * rows[l * n + j];
            rows[j * n + i] = sum * over;
            if (!raised) continue;
            const double whole = P[i * n + i];
            double left = whole;
            for (int l = 0; l < j; ++l) left -= rows[l * n + i] * rows[l * n + i];
            const double most = std::sqrt(std::max(left, kRounding * std::max(whole, 0.0)));
            rows[j * n + i] = std::min(std::max(rows[j * n + i], -most), most);
        }
    }
}

// Whether all pivots of a symmetric A (n, n) are at least this part of its diagonal, and that at least a part of B's, if any.
template <class T>
__attribute__((noinline)) void pivots_exceed(const T* A, double least, const T* B, double at_offset, int n, Mask<T>& good) {
    T L[kStates2], D[kMostStates];
    good = T{} == 0.0;
    for (int j = 0; j < n; ++j) {
        D[j] = A[j * n + j];
        for (int l = 0; l < j; ++l) D[j] -= L[j * n + l] * L[j * n + l] * D[l];
        good = good & (D[j] >= least * A[j * n + j]);
        if (B != nullptr) good = good & (A[j * n + j] >= at_offset * B[j * n + j]);
        const T over = D[j] > 0.0 ? 1.0 / D[j] : T{};
        for (int i = j + 1; i < n; ++i) {
            T sum = A[j * n + i];
            for (int l = 0; l < j; ++l) sum -= L[i * n + l] * L[j * n + l] * D[l];
            L[i * n + j] = sum * over;
        }
    }
}

// Of a prior with P = prior' prior (s, n), and H P = measured' prior (s, m): the inverse of S, the gain transposed (m, n), log |S|
// and the posterior covariance. The caller fills in the lower rows of `A`: measured and prior side by side, from row m.
struct SquareRootUpdate {
    double A[kMostRows][kMostColumns] = {};
    double inverse[kMeasured2], gain[kMostMeasured * kMostStates], post[kStates2], log_det;

    __attribute__((noinline, cold)) void solve(const double* R, int s, int n, int m) {
        double noise[kMeasured2], root[kMeasured2];  // root: the inverse of that of S
        bounded_root(R, noise, m);
        for (int i = 0; i < m; ++i)
            for (int j = 0; j < m; ++j) A[i][j] = noise[i * m + j];
        triangularise(A[0], m + s, m + n, kMostColumns);
        log_det = 0.0;
        for (int j = 0; j < m; ++j) {
            const double pivot = A[j][j] == 0.0 ? std::numeric_limits<double>::quiet_NaN() : A[j][j];
            log_det += 2.0 * std::log(std::fabs(A[j][j]));
            root[j * m + j] = 1.0 / pivot;
            for (int i = 0; i < j; ++i) {
                double sum = 0.0;
                for (int l = i; l < j; ++l) sum -= root[i * m + l] * A[l][j];
                root[i * m + j] = sum / pivot;
            }
        }
        for (int i = 0; i < m; ++i)
            for (int j = i; j < m; ++j) {
                double sum = 0.0;
                for (int l = j; l < m; ++l) sum += root[i * m + l] * root[j * m + l];
                inverse[i * m + j] = inverse[j * m + i] = sum;
            }
        for (int i = 0; i < m; ++i)
            for (int j = 0; j < n; ++j) {
                double sum = 0.0;
                for (int l = i; l < m; ++l) sum += root[i * m + l] * A[l][m + j];
                gain[i * n + j] = sum;
            }
        for (int i = 0; i < n; ++i)
            for (int j = i; j < n; ++j) {
                double sum = 0.0;
                for (int l = 0; l <= i && l < s; ++l) sum += A[m + l][m + i] * A[m + l][m + j];
                post[i * n + j] = post[j * n + i] = sum;
            }
    }
};

}  // namespace vedette::VEDETTE_ISA
