// The kernels of a bank of filters, for one problem or eight: what modes.py says in numpy. r modes, k returns.
#pragma once

#include "filters.hpp"

namespace vedette::VEDETTE_ISA {

// The sizes that banks of filters with stacked states have.
template <class F>
VEDETTE_INLINE void with_modes(int n, const F& f) {
    if constexpr (!kUnrolls) return f(n);
    if (n == 4) return f(std::integral_constant<int, 4>());
    if (n == 5) return f(std::integral_constant<int, 5>());
    f(n);
}

// All modes over the same n axes: means relative to the first mode's, which is `origin`; covariances.
template <class T>
struct StackedModes {
    T origin[kMostStates], deviations[kMostModes * kMostStates], P[kMostModes * kStates2];

    // After the means were read into `deviations`.
    VEDETTE_INLINE void center(int n, int r, const Periods& periods) {
        for (int a = 0; a < n; ++a) origin[a] = deviations[a];
        for (int j = 0; j < r; ++j) {
            for (int a = 0; a < n; ++a) deviations[j * n + a] -= origin[a];
            wrap(deviations + j * n, periods);
        }
    }

    // Mean, and covariance with the spread of the means, under the weights.
    template <class N>
    VEDETTE_INLINE void moments(const T* weights, T* mean, T* cov, N n, int r) const {
        outlined_for_eight<T, N>([=] { compute_moments(weights, mean, cov, n, r); });
    }

    template <class N>
    VEDETTE_INLINE void compute_moments(const T* weights, T* mean, T* cov, N n, int r) const {
        T step[kMostStates], away[kMostStates];
        for (int a = 0; a < n; ++a) {
            step[a] = weights[0] * deviations[a];
            for (int j = 1; j < r; ++j) step[a] += weights[j] * deviations[j * n + a];
            mean[a] = origin[a] + step[a];
            for (int b = a; b < n; ++b) cov[a * n + b] = T{};
        }
        for (int j = 0; j < r; ++j) {
            for (int a = 0; a < n; ++a) away[a] = deviations[j * n + a] - step[a];
            for (int a = 0; a < n; ++a)
                for (int b = a; b < n; ++b) cov[a * n + b] += weights[j] * (P[(j * n + a) * n + b] + away[a] * away[b]);
        }
        if constexpr (std::is_same_v<T, double>) copy_upper_to_lower(cov, n);
    }
};

// Neither infinite nor NaN.
template <class T>
VEDETTE_INLINE auto is_finite(const T& a) {
    constexpr double most = std::numeric_limits<double>::max();
    return (a >= -most) & (a <= most);
}

// The logarithm of sum exp, -inf where all are, and the exponentials up to a common factor.
template <class T>
VEDETTE_INLINE T log_sum(const T* a, int count, T* parts) {
    T top = a[0];
    for (int i = 1; i < count; ++i) top = Lane<T>::maximum(top, a[i]);
    top = is_finite(top) ? top : Lane<T>::broadcast(0.0);
    T sum = Lane<T>::broadcast(0.0);
    for (int i = 0; i < count; ++i) sum += parts[i] = Lane<T>::exp(a[i] - top);
    return Lane<T>::log(sum) + top;
}

// The modes' probabilities after switching, and from which modes each comes.
struct ModeMixing {
    // `log_after` (r), and for each mode to come the weights of those now (r, r).
    template <class T>
    VEDETTE_INLINE void weights_of(In log_prob, In log_transition, T* log_after, T* weights, int r) const {
        T before[kMostModes], prob[kMostModes];
        load(log_prob, before, r);
        T top = before[0];
        for (int i = 1; i < r; ++i) top = Lane<T>::maximum(top, before[i]);
        for (int i = 0; i < r; ++i) prob[i] = Lane<T>::exp(before[i] - top);
        if (log_transition.next == 0) {
            if (read != log_transition.at)
                for (int i = 0; i < r * r; ++i) table[i] = Lane<double>::exp(log_transition.at[i]);
            read = log_transition.at;
            for (int j = 0; j < r; ++j)
                for (int i = 0; i < r; ++i) weights[j * r + i] = table[i * r + j] * prob[i];
        } else {
            for (int j = 0; j < r; ++j)
                for (int i = 0; i < r; ++i)
                    weights[j * r + i] = Lane<T>::exp(Lane<T>::load(log_transition, i * r + j)) * prob[i];
        }
        bool good = true;
        for (int j = 0; j < r; ++j) {
            T sum = weights[j * r];
            for (int i = 1; i < r; ++i) sum += weights[j * r + i];
            good = good && all_of((sum > 1e-200) & (sum < 1e200));
            log_after[j] = Lane<T>::log(sum) + top;
            const T over = 1.0 / sum;
            for (int i = 0; i < r; ++i) weights[j * r + i] = normal_or_zero(weights[j * r + i] * over);
        }
        if (!good) weights_by_logarithms(before, log_transition, log_after, weights, r);
    }

  private:
    // The probabilities of switching that were read last, and where: a batch mostly shares them.
    mutable const double* read = nullptr;
    mutable double table[kMostModes * kMostModes] = {};

    // The same where a mode is next to impossible, or cannot be reached: then it starts from the whole mixture.
    template <class T>
    __attribute__((noinline, cold)) void weights_by_logarithms(const T* before, In transition, T* after, T* weights,
                                                             int r) const {
        T joint[kMostModes];
        for (int j = 0; j < r; ++j) {
            for (int i = 0; i < r; ++i) joint[i] = before[i] + Lane<T>::load(transition, i * r + j);
            T* own = weights + j * r;
            after[j] = log_sum(joint, r, own);
            const auto reached = is_finite(after[j]);
            T total{};
            for (int i = 0; i < r; ++i) total += own[i];
            for (int i = 0; i < r; ++i) own[i] = normal_or_zero(reached ? own[i] / total : Lane<T>::exp(before[i]));
        }
    }
};

// Each mode's own axes among the n of all: those that it lacks have the mean and variance stated in `absent`.
template <class T, class N>
VEDETTE_INLINE void stack_modes(StackedModes<T>& modes, const In* xs, const In* Ps, const shapes::MixModes& bank, N n) {
    const int r = bank.r;
    for (int j = 0; j < r; ++j) {
        T *mean = modes.deviations + j * n, *cov = modes.P + j * n * n;
        if (bank.same) {
            load(xs[j], mean, n), load_symmetric(Ps[j], cov, n);
            continue;
        }
        const int size = bank.sizes[j], *own = bank.own[j];
        for (int a = 0; a < n; ++a) mean[a] = Lane<T>::broadcast(bank.absent[a]);
        for (int a = 0; a < n * n; ++a) cov[a] = T{};
        for (int a = 0; a < n; ++a) cov[a * n + a] = Lane<T>::broadcast(bank.absent[n + a]);
        for (int a = 0; a < size; ++a) {
            mean[own[a]] = Lane<T>::load(xs[j], a);
            for (int b = 0; b < size; ++b) cov[own[a] * n + own[b]] = Lane<T>::load(Ps[j], a * size + b);
        }
    }
    modes.center(n, r, bank.periods);
}

// in: log_prob (r), log_transition (r, r), then r means, then r covariances; out: log_prob (r), r means, r covariances
struct MixModes : shapes::MixModes {
    ModeMixing mode_mixing;

    explicit MixModes(const shapes::MixModes& shape) : shapes::MixModes(shape) {}

    template <class T>
    void run(const In* in, const Out* out) const {
        with_modes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T after[kMostModes], weights[kMostModes * kMostModes], mean[kMostStates], cov[kStates2];
        mode_mixing.weights_of(in[0], in[1], after, weights, r);
        store(out[0], after, r);
        StackedModes<T> modes;
        stack_modes(modes, in + 2, in + 2 + r, *this, n);
        for (int j = 0; j < r; ++j) {
            modes.moments(weights + j * r, mean, cov, n, r);
            wrap(mean, periods);
            if (same) {
                store(out[1 + j], mean, n), store_symmetric(out[1 + r + j], cov, n);
                continue;
            }
            for (int a = 0; a < sizes[j]; ++a) {
                Lane<T>::store(out[1 + j], a, mean[own[j][a]]);
                for (int b = 0; b < sizes[j]; ++b)
                    Lane<T>::store(out[1 + r + j], a * sizes[j] + b, entry(cov, own[j][a], own[j][b], n));
            }
        }
    }
};

// in: log_prob (r), r means, r covariances; out: mean (n), covariance (n, n)
struct MixtureMoments : shapes::MixtureMoments {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_modes(bank.n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T weights[kMostModes], mean[kMostStates], cov[kStates2];
        load(in[0], weights, bank.r);
        for (int j = 0; j < bank.r; ++j) weights[j] = Lane<T>::exp(weights[j]);
        StackedModes<T> modes;
        stack_modes(modes, in + 1, in + 1 + bank.r, bank, n);
        modes.moments(weights, mean, cov, n, bank.r);
        wrap(mean, bank.periods);
        store(out[0], mean, n), store_symmetric(out[1], cov, n);
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
        for (int j = 1; j < r; ++j) volume = Lane<T>::maximum(volume, Lane<T>::load(volumes[j], 0));
        Lane<T>::store(out[2], 0, volume);
        for (int h = 0; h <= k; ++h) {
            for (int j = 0; j < r; ++j) joint[j] = Lane<T>::load(logliks[j], h) + before[j];
            const T loglik = log_sum(joint, r, parts);
            Lane<T>::store(out[0], h, loglik);
            for (int j = 0; j < r; ++j) Lane<T>::store(out[4], h * r + j, joint[j] - loglik);
            if (h == 0) continue;
            T expected = Lane<T>::broadcast(0.0), total = expected, least = Lane<T>::load(distances[0], h - 1);
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
        for (int j = 0; j < r; ++j) {
            top[j] = Lane<T>::broadcast(-std::numeric_limits<double>::infinity());
            sum[j] = Lane<T>::broadcast(0.0);
        }
        for (int h = 0; h <= k; ++h) {  // the logarithms wait in the outputs until the largest is known
            const T weight = Lane<T>::log(Lane<T>::load(in[0], h));
            for (int j = 0; j < r; ++j) {
                const T joint = weight + Lane<T>::load(in[1], h * r + j);
                top[j] = Lane<T>::maximum(joint, top[j]);
                Lane<T>::store(out[1 + j], h, joint);
            }
        }
        for (int j = 0; j < r; ++j) {
            top[j] = is_finite(top[j]) ? top[j] : Lane<T>::broadcast(0.0);
            const In own{out[1 + j].at, out[1 + j].next};
            for (int h = 0; h <= k; ++h) {
                const T at_offset = Lane<T>::exp(Lane<T>::load(own, h) - top[j]);
                Lane<T>::store(out[1 + j], h, at_offset);
                sum[j] += at_offset;
            }
            after[j] = Lane<T>::log(sum[j]) + top[j];
            const auto possible = sum[j] > 0.0;
            for (int h = 0; h <= k; ++h)
                Lane<T>::store(out[1 + j], h,
                               normal_or_zero(possible ? Lane<T>::load(own, h) / sum[j] : Lane<T>::load(in[0], h)));
        }
        const T total = log_sum(after, r, sum);
        for (int j = 0; j < r; ++j) Lane<T>::store(out[0], j, after[j] - total);
    }
};

}  // namespace vedette::VEDETTE_ISA
