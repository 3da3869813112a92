// The textbook's IMM-PDAF on stacked modes (r, n), for one target or eight: what reference.py says in numpy.
#pragma once

#include "modes.hpp"

namespace vedette::VEDETTE_ISA {

// in: log_prob (r), log_transition (r, r), xs (r, n), Ps (r, n, n); out: log_prob (r), xs, Ps
struct ImmMix : shapes::ImmMix {
    ModeMixing mode_mixing;

    explicit ImmMix(const shapes::ImmMix& shape) : shapes::ImmMix(shape) {}

    template <class T>
    void run(const In* in, const Out* out) const {
        with_modes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T after[kMostModes], weights[kMostModes * kMostModes], mean[kMostModes * kMostStates], cov[kMostModes * kStates2];
        mode_mixing.weights_of(in[0], in[1], after, weights, r);
        StackedModes<T> modes;
        load(in[2], modes.deviations, r * n), load_symmetric(in[3], modes.P, n, r);
        modes.center(n, r, Periods());
        for (int j = 0; j < r; ++j) modes.moments(weights + j * r, mean + j * n, cov + j * n * n, n, r);
        store(out[0], after, r), store(out[1], mean, r * n), store_symmetric(out[2], cov, n, r);
    }
};

// in: log_prob (r), loglik (r), xs (r, n), Ps (r, n, n); out: log_prob (r), x (n), P (n, n), loglik
struct ImmCombine : shapes::ImmCombine {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_modes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T joint[kMostModes], seen[kMostModes], weights[kMostModes], mean[kMostStates], cov[kStates2];
        load(in[0], joint, r), load(in[1], seen, r);
        for (int j = 0; j < r; ++j) joint[j] += seen[j];
        const T total = log_sum(joint, r, weights);
        for (int j = 0; j < r; ++j) joint[j] -= total, weights[j] = Lane<T>::exp(joint[j]);
        StackedModes<T> modes;
        load(in[2], modes.deviations, r * n), load_symmetric(in[3], modes.P, n, r);
        modes.center(n, r, Periods());
        modes.moments(weights, mean, cov, n, r);
        store(out[0], joint, r), store(out[1], mean, n), store_symmetric(out[2], cov, n);
        Lane<T>::store(out[3], 0, total);
    }
};

// in: xs (r, n), Ps (r, n, n), z (k, m), H, R; out: xs, Ps, loglik (r)
struct PdaUpdate : shapes::PdaUpdate {
    double log_miss, log_detect;

    explicit PdaUpdate(const shapes::PdaUpdate& shape)
        : shapes::PdaUpdate(shape), log_miss(safe_log(1.0 - p_detect * p_gate)), log_detect(safe_log(p_detect) - log_density) {}

    template <class T>
    void run(const In* in, const Out* out) const {
        with_usual_constants<T>(n, m, are_shared(in, {3, 4}), [&](auto states, auto measured, auto c) {
            solve<T, decltype(c)>(in, out, states, measured);
        });
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n, M m) const {
        const Rectangle<C> H(in[3], m * n);
        const Square<C> R(in[4], m, kSymmetric);
        const Matrix<T, kMostReturns * kMostMeasured> z(in[2], k * m);
        T x[kMostModes * kMostStates], P[kMostModes * kStates2];
        T expected[kMostModes * kMostMeasured], distance[kMostModes * kMostReturns], nearest[kMostReturns];
        Correction<T> corrections[kMostModes];
        load(in[0], x, r * n), load_symmetric(in[1], P, n, r);
        for (int h = 0; h < k; ++h) nearest[h] = Lane<T>::broadcast(std::numeric_limits<double>::infinity());
        for (int j = 0; j < r; ++j) {
            T nu[kMostMeasured], *own = expected + j * m;
            corrections[j].template prepare<C>(P + j * n * n, H, R, n, m);
            apply<T, C>(H, x + j * n, own, m, n);
            for (int h = 0; h < k; ++h) {
                for (int i = 0; i < m; ++i) nu[i] = z[h * m + i] - own[i];
                const T d = distance[j * k + h] = corrections[j].squared_distance(nu, m);
                nearest[h] = d < nearest[h] ? d : nearest[h];
            }
        }
        for (int j = 0; j < r; ++j) {
            const T loglik = association_weights(corrections[j].log_det, nearest, distance + j * k, m);
            Lane<T>::store(out[2], j, loglik);
            Correction<T>* correction = corrections + j;
            outlined_for_eight<T, N, M>([&, j] {
                weighted_update<T, C>(*correction, x + j * n, P + j * n * n, H, R, z, expected + j * m, distance + j * k, n, m);
            });
        }
        store(out[0], x, r * n), store_symmetric(out[1], P, n, r);
    }

    // Squared distances (k) into association weights; gives the log-likelihood of the scan.
    template <class T>
    __attribute__((noinline)) T association_weights(T log_det, const T* nearest, T* distance, int m) const {
        const T least = log_detect - 0.5 * (log_det + m * kLog2Pi);
        T top = Lane<T>::broadcast(log_miss);
        for (int h = 0; h < k; ++h) {
            distance[h] = nearest[h] <= limit ? least - 0.5 * distance[h] : Lane<T>::broadcast(-std::numeric_limits<double>::max());
            top = Lane<T>::maximum(top, distance[h]);
        }
        T sum = Lane<T>::exp(log_miss - top);
        for (int h = 0; h < k; ++h) sum += distance[h] = Lane<T>::exp(distance[h] - top);
        const T over = 1.0 / sum;
        for (int h = 0; h < k; ++h) distance[h] = normal_or_zero(distance[h] * over);
        return top + Lane<T>::log(sum);
    }

    // x and P after association, with D the spread of the returns: w_0 P + (1 - w_0) (P - K S K') + K D K', which is
    // P - K ((1 - w_0) S - D) K' where that keeps its digits; else as a sum of squares, the noise being R + D / (1 - w_0).
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void weighted_update(Correction<T>& correction, T* x, T* P, const C* H, const C* R, const T* z,
                                        const T* expected, const T* weights, N n, M m) const {
        T nu[kMostMeasured], mean[kMostMeasured], spread[kMeasured2], transposed[kMostMeasured * kMostStates], hit{};
        for (int i = 0; i < m; ++i) mean[i] = T{};
        for (int h = 0; h < k; ++h) {
            hit += weights[h];
            for (int i = 0; i < m; ++i) mean[i] += weights[h] * (z[h * m + i] - expected[i]);
        }
        const T miss = 1.0 - hit;
        for (int i = 0; i < m; ++i)
            for (int l = i; l < m; ++l) set_entry(spread, i, l, m, T(miss * mean[i] * mean[l]));
        for (int h = 0; h < k; ++h) {
            for (int i = 0; i < m; ++i) nu[i] = z[h * m + i] - expected[i] - mean[i];
            for (int i = 0; i < m; ++i)
                for (int l = i; l < m; ++l) set_entry(spread, i, l, m, T(spread[i * m + l] + weights[h] * nu[i] * nu[l]));
        }
        correction.mean_shift(mean, transposed, n, m);
        for (int i = 0; i < n; ++i) x[i] += transposed[i];
        if (correction.keeps_digits) {
            multiply<kLeft>(spread, correction.gain, transposed, m, m, n);
            for (int i = 0; i < m * n; ++i) transposed[i] = hit * correction.cross[i] - transposed[i];
            return correction.short_form(P, transposed, P, n, m);
        }
        T post[kStates2];
        const T over = hit > 1e-300 ? 1.0 / hit : T{};  // beyond, 1 / hit overflows
        for (int i = 0; i < m; ++i)
            for (int l = i; l < m; ++l) set_entry(spread, i, l, m, T(R[i * m + l] + spread[i * m + l] * over));
        Mask<T> kept;
        correction.joseph_form(P, H, spread, post, n, m, kept);
        for (int i = 0; i < n; ++i)
            for (int l = i; l < n; ++l) set_entry(post, i, l, n, T(miss * P[i * n + l] + hit * post[i * n + l]));
        if (!all_of(kept & correction.is_regular) && !correction.keeps_pivots(P, post, n, kept))
            mix_by_square_root<T, C>(correction, P, H, R, z, expected, weights, post, n, m, kept);
        for (int i = 0; i < n; ++i)
            for (int l = i; l < n; ++l) set_entry(P, i, l, n, post[i * n + l]);
    }

    // The covariance after association of those problems whose digits were not kept, as sums of squares.
    template <class T, class C>
    __attribute__((noinline, cold)) void mix_by_square_root(Correction<T>& correction, const T* P, const C* H, const C* R,
                                                            const T* z, const T* expected, const T* weights, T* to, int n,
                                                            int m, const Mask<T>& kept) const {
        T own[kStates2], nu[kMostMeasured], mean[kMostMeasured], apart[kMostStates], hit{};
        for (int i = 0; i < n * n; ++i) own[i] = T{};
        correction.template recompute_by_square_root<T, C>(P, H, R, own, n, m, kept);
        for (int i = 0; i < m; ++i) mean[i] = T{};
        for (int h = 0; h < k; ++h) {
            hit += weights[h];
            for (int i = 0; i < m; ++i) mean[i] += weights[h] * (z[h * m + i] - expected[i]);
        }
        for (int i = 0; i < n * n; ++i) own[i] = (1.0 - hit) * P[i] + hit * own[i];
        for (int h = -1; h < k; ++h) {  // -1: none of them
            for (int i = 0; i < m; ++i) nu[i] = h < 0 ? mean[i] : z[h * m + i] - expected[i] - mean[i];
            correction.mean_shift(nu, apart, n, m);
            for (int i = 0; i < n; ++i)
                for (int j = i; j < n; ++j) own[i * n + j] += (h < 0 ? 1.0 - hit : weights[h]) * apart[i] * apart[j];
        }
        for (int l = 0; l < Lane<T>::count; ++l)
            for (int i = 0; i < n * n && !is_set(kept, l); ++i) set_lane(to[i], l, lane(entry(own, i / n, i % n, n), l));
    }
};

}  // namespace vedette::VEDETTE_ISA
