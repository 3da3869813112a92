// What association says of tracks that may not exist and of returns, as association.py says it: a few numbers a track.
#pragma once

#include "twins.hpp"

namespace vedette::entries {

constexpr double kNormal = std::numeric_limits<double>::min(), kLeastLog = -708.3964185322641;  // the logarithm of the first

inline double log_or_least(double p) { return std::log(p > kNormal ? p : kNormal); }

// Arguments: weights (*b, t, 1+k), and whether no two tracks share a return.
inline PyObject* claimed(Call& call, Args args) {
    const npy_intp* weights = call.in(args[0], 2);
    if (!PyBool_Check(args[1]) || !call.ok || weights[1] < 1 || !call.broadcast()) return nullptr;
    const npy_intp t = weights[0], k = weights[1] - 1;
    PyObject* some = call.out(1, k);
    if (some == nullptr) return nullptr;
    for (Problems each(call.batch); each.next();) {
        double* to = each.out(0);
        for (npy_intp h = 0; h < k; ++h) {
            const double* weight = each.in(0) + 1 + h;
            double sum = 0.0, free = 1.0;
            for (npy_intp i = 0; i < t; ++i) sum += weight[i * (1 + k)], free *= 1.0 - weight[i * (1 + k)];
            to[h] = args[1] == Py_True ? (sum < 1.0 ? sum : 1.0) : 1.0 - free;
        }
    }
    return some;
}

// Arguments: scores (*b, t, 1+k), log (1 - P_D P_G) (*b, t), existence (*b, t).
inline PyObject* if_existing(Call& call, Args args) {
    const npy_intp* scores = call.in(args[0], 1);
    call.in(args[1], 0), call.in(args[2], 0);
    if (!call.ok || scores[0] < 1 || !call.broadcast()) return nullptr;
    const npy_intp columns = scores[0];
    PyObject* sure = call.out(1, columns);
    if (sure == nullptr) return nullptr;
    for (Problems each(call.batch); each.next();) {
        const double exists = *each.in(2);
        const bool doubted = exists > 0.0 && exists < 1.0;
        const double off = doubted ? log_or_least(exists) : 0.0;
        each.out(0)[0] = doubted ? *each.in(1) : each.in(0)[0];
        for (npy_intp h = 1; h < columns; ++h) each.out(0)[h] = each.in(0)[h] - off;
    }
    return sure;
}

// Arguments: weights, scores and log-likelihoods (*b, t, 1+k), existence (*b, t).
inline PyObject* given_existence(Call& call, Args args) {
    const npy_intp *weights = call.in(args[0], 1), *scores = call.in(args[1], 1), *loglik = call.in(args[2], 1);
    call.in(args[3], 0);
    if (!call.ok || weights[0] < 1 || scores[0] != weights[0] || loglik[0] < 1 || !call.broadcast()) return nullptr;
    const npy_intp columns = weights[0];
    PyObject* alive = call.out(1, columns);
    if (alive == nullptr) return nullptr;
    for (Problems each(call.batch); each.next();) {
        const double *weight = each.in(0), exists = *each.in(3);
        const double exponent = log_or_least(exists) + each.in(2)[0] - each.in(1)[0];
        const double kept = exponent < kLeastLog ? 0.0 : std::exp(exponent);
        const bool doubted = exists < 1.0 && std::isfinite(kept);
        double* to = each.out(0);
        to[0] = weight[0] * (doubted && kept < 1.0 ? kept : 1.0);
        double total = to[0];
        for (npy_intp h = 1; h < columns; ++h) total += to[h] = weight[h];
        if (doubted && total > 0.0)
            for (npy_intp h = 0; h < columns; ++h) to[h] = to[h] / total < kNormal ? 0.0 : to[h] / total;
        else
            to[0] = weight[0];
    }
    return alive;
}

}  // namespace vedette::entries
