// The kernels of a bank of filters, for one problem or eight: what modes.py says in numpy. r modes, k returns.
#pragma once

#include "filters.hpp"

namespace vedette::VEDETTE_ISA {

// All modes over the same n axes: means relative to the first mode's, which is `origin`.
template <class T>
struct Bank {
    T origin[kMostStates], apart[kMostModes][kMostStates], P[kMostModes][kStates2];

    void take(const In* xs, const In* Ps, const int (*own)[kMostStates], const int* sizes, const double* absent, int n, int r,
              const Periods& periods) {
        for (int j = 0; j < r; ++j) {
            for (int a = 0; a < n; ++a) apart[j][a] = Lane<T>::all(absent[a]);
            if (sizes[j] < n) {
                for (int a = 0; a < n * n; ++a) P[j][a] = Lane<T>::all(0.0);
                for (int a = 0; a < n; ++a) P[j][a * n + a] = Lane<T>::all(absent[n + a]);
            }
            for (int a = 0; a < sizes[j]; ++a) {
                apart[j][own[j][a]] = Lane<T>::load(xs[j], a);
                for (int b = 0; b < sizes[j]; ++b) P[j][own[j][a] * n + own[j][b]] = Lane<T>::load(Ps[j], a * sizes[j] + b);
            }
        }
        for (int a = 0; a < n; ++a) origin[a] = apart[0][a];
        for (int j = 0; j < r; ++j) {
            for (int a = 0; a < n; ++a) apart[j][a] -= origin[a];
            wrap(apart[j], periods);
        }
    }

    // Mean from the origin, and covariance with the spread of the means, under the weights.
    VEDETTE_INLINE void moments(const T* weights, T* mean, T* cov, int n, int r) const {
        for (int a = 0; a < n; ++a) {
            mean[a] = weights[0] * apart[0][a];
            for (int j = 1; j < r; ++j) mean[a] += weights[j] * apart[j][a];
        }
        for (int a = 0; a < n * n; ++a) {
            cov[a] = weights[0] * P[0][a];
            for (int j = 1; j < r; ++j) cov[a] += weights[j] * P[j][a];
        }
        make_symmetric(cov, n);
        for (int j = 0; j < r; ++j)
            for (int a = 0; a < n; ++a) {
                const T scaled = weights[j] * (apart[j][a] - mean[a]);
                for (int b = a; b < n; ++b) {
                    cov[a * n + b] += scaled * (apart[j][b] - mean[b]);
                    cov[b * n + a] = cov[a * n + b];
                }
            }
    }
};

// The logarithm of sum exp, -inf where all are, and the exponentials up to a common factor.
template <class T>
VEDETTE_INLINE T log_sum(const T* a, int count, T* parts) {
    T top = a[0];
    for (int i = 1; i < count; ++i) top = Lane<T>::larger(top, a[i]);
    constexpr double most = std::numeric_limits<double>::max();
    top = (top >= -most) & (top <= most) ? top : Lane<T>::all(0.0);
    T sum = Lane<T>::all(0.0);
    for (int i = 0; i < count; ++i) sum += parts[i] = Lane<T>::exp(a[i] - top);
    return Lane<T>::log(sum) + top;
}

// in: log_prob (r), log_transition (r, r), then r means, then r covariances; out: log_prob (r), r means, r covariances
struct Interact : shapes::Interact {
    template <class T>
    void run(const In* in, const Out* out) const {
        Bank<T> bank;
        bank.take(in + 2, in + 2 + r, own, sizes, absent, n, r, periods);
        T before[kMostModes], joint[kMostModes], weights[kMostModes], mean[kMostStates], cov[kStates2];
        load(in[0], before, r);
        constexpr double most = std::numeric_limits<double>::max();
        for (int j = 0; j < r; ++j) {
            for (int i = 0; i < r; ++i) joint[i] = before[i] + Lane<T>::load(in[1], i * r + j);
            const T after = log_sum(joint, r, weights);
            Lane<T>::store(out[0], j, after);
            const auto reached = (after >= -most) & (after <= most);
            T total = Lane<T>::all(0.0);
            for (int i = 0; i < r; ++i) total += weights[i];
            for (int i = 0; i < r; ++i) weights[i] = reached ? weights[i] / total : Lane<T>::exp(before[i]);
            bank.moments(weights, mean, cov, n, r);
            for (int a = 0; a < n; ++a) mean[a] += bank.origin[a];
            wrap(mean, periods);
            for (int a = 0; a < sizes[j]; ++a) {
                Lane<T>::store(out[1 + j], a, mean[own[j][a]]);
                for (int b = 0; b < sizes[j]; ++b)
                    Lane<T>::store(out[1 + r + j], a * sizes[j] + b, cov[own[j][a] * n + own[j][b]]);
            }
        }
    }
};

// in: log_prob (r), r means, r covariances; out: mean (n), covariance (n, n)
struct Together : shapes::Together {
    template <class T>
    void run(const In* in, const Out* out) const {
        const int n = bank.n, r = bank.r;
        Bank<T> all;
        all.take(in + 1, in + 1 + r, bank.own, bank.sizes, bank.absent, n, r, bank.periods);
        T weights[kMostModes], mean[kMostStates], cov[kStates2];
        load(in[0], weights, r);
        for (int j = 0; j < r; ++j) weights[j] = Lane<T>::exp(weights[j]);
        all.moments(weights, mean, cov, n, r);
        for (int a = 0; a < n; ++a) mean[a] += all.origin[a];
        wrap(mean, bank.periods);
        store(out[0], mean, n), store(out[1], cov, n * n);
    }
};

// in: log_prob (r), then of each mode loglik (1+k), distance (k), log volume, nis (k)
// out: loglik (1+k), distance (k), log volume, nis (k), log share (1+k, r)
struct WeighModes : shapes::WeighModes {
    template <class T>
    void run(const In* in, const Out* out) const {
        const In *logliks = in + 1, *distances = in + 1 + r, *volumes = in + 1 + 2 * r, *nis = in + 1 + 3 * r;
        T before[kMostModes], joint[kMostModes], parts[kMostModes];
        load(in[0], before, r);
        T volume = Lane<T>::load(volumes[0], 0);
        for (int j = 1; j < r; ++j) volume = Lane<T>::larger(volume, Lane<T>::load(volumes[j], 0));
        Lane<T>::store(out[2], 0, volume);
        for (int h = 0; h <= k; ++h) {
            for (int j = 0; j < r; ++j) joint[j] = Lane<T>::load(logliks[j], h) + before[j];
            const T loglik = log_sum(joint, r, parts);
            Lane<T>::store(out[0], h, loglik);
            for (int j = 0; j < r; ++j) Lane<T>::store(out[4], h * r + j, joint[j] - loglik);
            if (h == 0) continue;
            T expected = Lane<T>::all(0.0), total = expected, least = Lane<T>::load(distances[0], h - 1);
            for (int j = 0; j < r; ++j) {
                const T distance = Lane<T>::load(distances[j], h - 1);
                least = distance < least ? distance : least;
                expected += parts[j] * Lane<T>::load(nis[j], h - 1);
                total += parts[j];
            }
            Lane<T>::store(out[1], h - 1, least);
            Lane<T>::store(out[3], h - 1, expected / total);
        }
    }
};

// in: weights (1+k), log share (1+k, r); out: log_prob (r), then of each mode its weights (1+k)
struct SplitWeights : shapes::SplitWeights {
    template <class T>
    void run(const In* in, const Out* out) const {
        T after[kMostModes], top[kMostModes], sum[kMostModes];
        constexpr double most = std::numeric_limits<double>::max();
        for (int j = 0; j < r; ++j) {
            top[j] = Lane<T>::all(-std::numeric_limits<double>::infinity());
            sum[j] = Lane<T>::all(0.0);
        }
        for (int h = 0; h <= k; ++h) {  // the logarithms wait in the outputs until the largest is known
            const T weight = Lane<T>::log(Lane<T>::load(in[0], h));
            for (int j = 0; j < r; ++j) {
                const T joint = weight + Lane<T>::load(in[1], h * r + j);
                top[j] = Lane<T>::larger(joint, top[j]);
                Lane<T>::store(out[1 + j], h, joint);
            }
        }
        for (int j = 0; j < r; ++j) {
            top[j] = (top[j] >= -most) & (top[j] <= most) ? top[j] : Lane<T>::all(0.0);
            const In own{out[1 + j].at, out[1 + j].next};
            for (int h = 0; h <= k; ++h) {
                const T part = Lane<T>::exp(Lane<T>::load(own, h) - top[j]);
                Lane<T>::store(out[1 + j], h, part);
                sum[j] += part;
            }
            after[j] = Lane<T>::log(sum[j]) + top[j];
            const auto possible = sum[j] > 0.0;
            for (int h = 0; h <= k; ++h)
                Lane<T>::store(out[1 + j], h, possible ? Lane<T>::load(own, h) / sum[j] : Lane<T>::load(in[0], h));
        }
        const T total = log_sum(after, r, sum);
        for (int j = 0; j < r; ++j) Lane<T>::store(out[0], j, after[j] - total);
    }
};

}  // namespace vedette::VEDETTE_ISA
