// The kernels of weighted points, eight of a track's points side by side: what vedette_standard/particles.py says in numpy.
#pragma once

#include <algorithm>

#include "filters.hpp"

namespace vedette::VEDETTE_ISA {

constexpr double kLeastLogWeight = -230.0;  // of a weight that counts as one, 1e-100

// Calls f with the first of each eight points; the last eight may have some of those before them once more, marked by how many.
template <class F>
VEDETTE_INLINE void by_eight(int p, const F& f) {
    for (int i = 0; i < p; i += kLanes) {
        const int from = i + kLanes <= p ? i : p - kLanes;
        f(from, i - from);
    }
}

VEDETTE_INLINE Eight eight_at(const double* at) { return Lane<Eight>::load({at, 1}, 0); }

// One that counts the first `again` lanes as nothing.
VEDETTE_INLINE Eight without(Eight value, int again) {
    for (int l = 0; l < again; ++l) value[l] = 0.0;
    return value;
}

VEDETTE_INLINE double sum_of(Eight value) {
    return ((value[0] + value[4]) + (value[2] + value[6])) + ((value[1] + value[5]) + (value[3] + value[7]));
}

VEDETTE_INLINE double largest_of(Eight value) {
    double most = value[0];
    for (int l = 1; l < kLanes; ++l) most = value[l] > most ? value[l] : most;
    return most;
}

// log sum exp of what `term` says of each eight points; -inf where all terms are.
template <class F>
VEDETTE_INLINE double log_sum_over(int p, const F& term) {
    Eight top = Lane<Eight>::broadcast(-std::numeric_limits<double>::infinity()), total{};
    by_eight(p, [&](int i, int) {
        const Eight own = term(i);
        top = own > top ? own : top;
    });
    const double most = largest_of(top);
    if (!std::isfinite(most)) return most;
    by_eight(p, [&](int i, int again) { total += without(Lane<Eight>::exp(term(i) - most), again); });
    return std::log(sum_of(total)) + most;
}

// in: log weights (p), returns z (k, m), what points expect (p, m), R (1|p, m, m), P_D (1|p)
// out: log likelihoods (1+k, p), their means (1+k), mean of what points expect (m), its covariance (m, m), mean of R (m, m)
struct EvaluateParticles : shapes::EvaluateParticles {
    static constexpr bool kOneByOne = true;

    void run(const In* in, const Out* out) const {
        if (m == 2) return solve(in, out, std::integral_constant<int, 2>());
        solve(in, out, m);
    }
    template <class M>
    VEDETTE_INLINE void solve(const In* in, const Out* out, M m) const {
        const double *log_weights = in[0].at, *expected = in[2].at;
        double* likelihoods = out[0].at;
        Eight mean[kMostMeasured] = {}, noise[kMeasured2] = {}, cov[kMeasured2] = {};
        const auto weights_at = [&](int i, int again) {
            const Eight log_weight = eight_at(log_weights + i);
            return without(log_weight < kLeastLogWeight ? Eight{} : Lane<Eight>::exp(log_weight), again);
        };
        by_eight(p, [&](int i, int again) {
            Eight x[kMostMeasured], L[kMeasured2], nu[kMostMeasured], half_log_det{};
            const Eight weights = weights_at(i, again);
            const In R{in[3].at + (noises == 1 ? 0 : i * m * m), noises == 1 ? 0 : m * m};
            for (int a = 0; a < m; ++a) x[a] = Lane<Eight>::load({expected + i * m, m}, a);
            for (int j = 0; j < m; ++j)  // R = L L', with inverse pivots
                for (int a = j; a < m; ++a) {
                    const Eight own = Lane<Eight>::load(R, a * m + j);
                    noise[a * m + j] += weights * own;
                    Eight sum = own;
                    for (int l = 0; l < j; ++l) sum -= L[a * m + l] * L[j * m + l];
                    if (a == j) half_log_det += 0.5 * Lane<Eight>::log(sum);
                    L[a * m + j] = a == j ? 1.0 / Lane<Eight>::sqrt(sum) : sum * L[j * m + j];
                }
            const Eight detects = Lane<Eight>::load({in[4].at + (detected == 1 ? 0 : i), detected == 1 ? 0 : 1}, 0);
            const Eight least = safe_log(detects) - half_log_det - 0.5 * m * kLog2Pi, miss = safe_log(1.0 - detects * p_gate);
            std::memcpy(likelihoods + i, &miss, sizeof miss);
            for (int h = 0; h < k; ++h) {
                Eight squared{};
                for (int a = 0; a < m; ++a) nu[a] = in[1].at[h * m + a] - x[a];
                wrap(nu, periods);
                for (int a = 0; a < m; ++a) {
                    for (int l = 0; l < a; ++l) nu[a] -= L[a * m + l] * nu[l];
                    nu[a] *= L[a * m + a];
                    squared += nu[a] * nu[a];
                }
                const Eight own = least - 0.5 * squared;
                std::memcpy(likelihoods + (1 + h) * p + i, &own, sizeof own);
            }
            for (int a = 0; a < m; ++a) x[a] -= expected[a];  // around the first point
            wrap(x, periods);
            for (int a = 0; a < m; ++a) mean[a] += weights * x[a];
        });
        double centre[kMostMeasured];
        for (int a = 0; a < m; ++a) centre[a] = expected[a] + sum_of(mean[a]);
        wrap(centre, periods);
        by_eight(p, [&](int i, int again) {
            Eight x[kMostMeasured];
            const Eight weights = weights_at(i, again);
            for (int a = 0; a < m; ++a) x[a] = Lane<Eight>::load({expected + i * m, m}, a) - centre[a];
            wrap(x, periods);
            for (int j = 0; j < m; ++j)
                for (int a = j; a < m; ++a) cov[a * m + j] += weights * x[a] * x[j];
        });
        for (int h = 0; h <= k; ++h)
            out[1].at[h] = log_sum_over(p, [&](int i) { return eight_at(likelihoods + h * p + i) + eight_at(log_weights + i); });
        for (int j = 0; j < m; ++j) {
            out[2].at[j] = centre[j];
            for (int a = j; a < m; ++a) {
                out[3].at[a * m + j] = out[3].at[j * m + a] = sum_of(cov[a * m + j]);
                out[4].at[a * m + j] = out[4].at[j * m + a] = noises == 1 ? in[3].at[a * m + j] : sum_of(noise[a * m + j]);
            }
        }
    }
};

// in: log weights (p), log likelihoods (1+k, p), their means (1+k), weights of association (1+k); out: log weights (p)
struct ReweighParticles : shapes::ReweighParticles {
    static constexpr bool kOneByOne = true;

    void run(const In* in, const Out* out) const {
        const double *log_weights = in[0].at, *likelihoods = in[1].at, none = -std::numeric_limits<double>::infinity();
        double share[1 + kMostReturns], *to = out[0].at;
        Eight most = Lane<Eight>::broadcast(none);
        for (int h = 0; h <= k; ++h)
            share[h] = std::log(in[3].at[h]) - (std::isfinite(in[2].at[h]) ? in[2].at[h] : 0.0);
        by_eight(p, [&](int i, int) {
            Eight top = Lane<Eight>::broadcast(none), total{};
            for (int h = 0; h <= k; ++h) {
                const Eight own = eight_at(likelihoods + h * p + i) + share[h];
                top = own > top ? own : top;
            }
            most = top > most ? top : most;
            const Eight from = top > none ? top : Eight{};
            for (int h = 0; h <= k; ++h) total += Lane<Eight>::exp(eight_at(likelihoods + h * p + i) + share[h] - from);
            const Eight now = eight_at(log_weights + i) + (from + Lane<Eight>::log(total));
            std::memcpy(to + i, &now, sizeof now);
        });
        if (!std::isfinite(largest_of(most))) std::copy_n(log_weights, p, to);  // nothing is possible: as if undetected
        const double all = log_sum_over(p, [&](int i) { return eight_at(to + i); });
        for (int i = 0; i < p; ++i) to[i] -= all;
    }
};

}  // namespace vedette::VEDETTE_ISA
