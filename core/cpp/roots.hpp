// The square-root filter: orthogonal triangularisations, and its prediction and evaluation through twins, as
// estimators/square_root.py says them.
#pragma once

#include <vector>

#include "triangular.hpp"
#include "twin_entries.hpp"

namespace vedette {

// A lower triangular L (n, n) with L L' = R, where a pivot within rounding of nothing has no column: kernels.root.
inline void lower_root(const double* R, double* L, int n) {
    std::fill_n(L, n * n, 0.0);
    for (int j = 0; j < n; ++j) {
        double pivot = R[j * n + j];
        for (int l = 0; l < j; ++l) pivot -= L[j * n + l] * L[j * n + l];
        if (!(pivot > 8 * n * std::numeric_limits<double>::epsilon() * R[j * n + j])) continue;
        const double root = std::sqrt(pivot);
        L[j * n + j] = root;
        for (int i = j + 1; i < n; ++i) {
            double sum = R[i * n + j];
            for (int l = 0; l < j; ++l) sum -= L[i * n + l] * L[j * n + l];
            L[i * n + j] = sum / root;
        }
    }
}

namespace entries {

inline PyObject* root(Call& call, Args args) {
    const npy_intp* P = call.in(args[0], 2);
    if (!call.ok || P[0] < 1 || P[0] > kMostStates || !square(P, P[0]) || !call.broadcast()) return nullptr;
    PyObject* L = call.out(2, P[0], P[0]);
    if (L != nullptr)
        for (Problems each(call.batch); each.next();) lower_root(each.in(0), each.out(0), static_cast<int>(P[0]));
    return L;
}

// Argument: A (n, p), p >= n. A lower triangular L (n, n) with L L' = A A'.
inline PyObject* lower_triangular(Call& call, Args args) {
    const npy_intp* A = call.in(args[0], 2);
    if (!call.ok || A[0] < 1 || A[0] > kMostStates || A[1] < A[0] || !call.broadcast()) return nullptr;
    const int n = static_cast<int>(A[0]), p = static_cast<int>(A[1]);
    PyObject* L = call.out(2, n, n);
    if (L == nullptr) return nullptr;
    std::vector<double> rows(static_cast<std::size_t>(n * p));
    for (Problems each(call.batch); each.next();) {
        for (int i = 0; i < p; ++i)
            for (int j = 0; j < n; ++j) rows[static_cast<std::size_t>(i * n + j)] = each.in(0)[j * p + i];
        triangularise(rows.data(), p, n, n);
        transpose_into(rows.data(), n, 0, n, each.out(0));
    }
    return L;
}

// Arguments: x, L, dt, function, parameters, periods of the state: the moved x, and a root of F L L' F' + Q.
inline PyObject* predict_root_twin(Call& call, Args args) {
    Twin<MotionTwin> twin;
    Periods periods;
    if (!read_periods(args[5], periods) || !twin.read(args[3], kMotion)) return nullptr;
    const npy_intp *x = call.in(args[0], 1), *L = call.in(args[1], 2), *own = call.in(args[4], 1);
    const double dt = call.number(args[2]);
    if (!call.ok || !sized(x[0], 1, own[0]) || !square(L, x[0]) || !are_among(periods, x[0]) || !call.broadcast()) return nullptr;
    const int n = static_cast<int>(x[0]);
    PyObject *to = call.out(1, n), *root = call.out(2, n, n);
    if (to != nullptr && root != nullptr)
        for (Problems each(call.batch); each.next();) {
            double F[kStates2], Q[kStates2], noise[kStates2], rows[2 * kStates2];
            twin.function(1, dt, each.in(0), each.in(2), each.out(0), F, Q, twin.data);
            wrap(each.out(0), periods);
            lower_root(Q, noise, n);
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) {
                    double sum = 0.0;
                    for (int l = 0; l < n; ++l) sum += F[j * n + l] * each.in(1)[l * n + i];
                    rows[i * n + j] = sum, rows[(n + i) * n + j] = noise[j * n + i];
                }
            triangularise(rows, 2 * n, n, n);
            transpose_into(rows, n, 0, n, each.out(1));
        }
    return call.pack(to, root);
}

// Arguments: x, L, returns z, their noises (*b, 1, k, m, m) or None, function, parameters, axes observed, P_G, periods of z.
inline PyObject* evaluate_root_twin(Call& call, Args args) {
    Twin<SensorTwin> twin;
    Axes axes;
    Periods measured;
    if (!read_periods(args[8], measured) || !twin.read(args[4], kSensor)) return nullptr;
    const npy_intp *x = call.in(args[0], 1), *L = call.in(args[1], 2), *z = call.in(args[2], 2, true), *own = call.in(args[5], 1),
                   *R = args[3] == Py_None ? nullptr : call.in(args[3], 3);
    const double p_gate = call.number(args[7]);
    if (!call.ok) return nullptr;
    const npy_intp n = x[0], k = z[0], m = z[1], noises = R == nullptr ? 1 : R[0];
    if (!sized(n, m, own[0]) || !square(L, n) || !axes.read(args[6], n) || !are_among(measured, m) ||
        (R != nullptr && (!square(R + 1, m) || (noises != 1 && noises != k))) || !call.broadcast())
        return nullptr;
    PyObject *loglik = call.out(1, 1 + k), *distance = call.out(1, k), *volume = call.out(0), *shift = call.out(2, k, n),
             *post = call.out(3, noises, n, n);
    const int d = static_cast<int>(n), o = static_cast<int>(m), q = o + d, numbers = static_cast<int>(own[0]);
    if (loglik && distance && volume && shift && post)
        for (Problems each(call.batch); each.next();) {
            double seen[kMostStates], parameters[kMostParameters], at[kMostMeasured], H[kMostMeasured * kMostStates];
            double sensor[kMeasured2], detects, rows[(kMostMeasured + kMostStates) * (kMostMeasured + kMostStates)];
            for (int a = 0; a < axes.count; ++a) seen[a] = each.in(0)[axes.each[a]];
            std::copy_n(each.in(3), numbers, parameters);
            twin.function(1, seen, parameters, at, H, sensor, &detects, twin.data);
            constexpr double tiny = std::numeric_limits<double>::min();
            const double miss = 1.0 - detects * p_gate, hit = std::log(detects > tiny ? detects : tiny);
            each.out(0)[0] = std::log(miss > tiny ? miss : tiny);
            double largest = -std::numeric_limits<double>::infinity();
            for (npy_intp h = 0; h < noises; ++h) {
                double noise[kMeasured2];
                lower_root(R == nullptr ? sensor : each.in(4) + h * m * m, noise, o);
                std::fill_n(rows, q * q, 0.0);
                for (int i = 0; i < o; ++i)
                    for (int j = i; j < o; ++j) rows[i * q + j] = noise[j * o + i];
                for (int i = 0; i < d; ++i) {
                    double* row = rows + (o + i) * q;
                    for (int j = 0; j < o; ++j)
                        for (int a = 0; a < axes.count; ++a) row[j] += H[j * axes.count + a] * each.in(1)[axes.each[a] * n + i];
                    for (int a = 0; a < d; ++a) row[o + a] = each.in(1)[a * n + i];
                }
                triangularise(rows, q, q, q);
                transpose_into(rows, q, o, d, each.out(4) + h * n * n);
                double log_root = 0.0;
                for (int j = 0; j < o; ++j) log_root += std::log(std::fabs(rows[j * q + j]));
                largest = std::max(largest, log_root);
                for (npy_intp g = noises == 1 ? 0 : h; g < (noises == 1 ? k : h + 1); ++g) {
                    double white[kMostMeasured], squared = 0.0;
                    for (int j = 0; j < o; ++j) white[j] = each.in(2)[g * m + j] - at[j];
                    wrap(white, measured);
                    for (int j = 0; j < o; ++j) {
                        for (int l = 0; l < j; ++l) white[j] -= rows[l * q + j] * white[l];
                        white[j] /= rows[j * q + j], squared += white[j] * white[j];
                    }
                    each.out(0)[1 + g] = hit - 0.5 * (squared + o * 1.8378770664093454836) - log_root;
                    each.out(1)[g] = squared;
                    for (int a = 0; a < d; ++a) {
                        double sum = 0.0;
                        for (int j = 0; j < o; ++j) sum += rows[j * q + o + a] * white[j];
                        each.out(3)[g * n + a] = sum;
                    }
                }
            }
            *each.out(2) = largest;
        }
    return call.pack(loglik, distance, volume, Py_XNewRef(distance), call.pack_within(shift, post));
}

}  // namespace entries
}  // namespace vedette
