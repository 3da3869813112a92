// The kernels of one filter, for one problem or eight: what reference.py says in numpy.
//
// Letters are the reference's: n state, m measured, k returns.
#pragma once

#include "correction.hpp"

namespace vedette::VEDETTE_ISA {

// F x and F P F' + Q of the inputs x, P, F, Q.
template <class T, class C, class N>
VEDETTE_INLINE void predict_moments(const In* in, T* to, T* cov, N n) {
    const Vector<T> x(in[0], n);
    const Square<T> P(in[1], n, kSymmetric);
    const Square<C> F(in[2], n * n), Q(in[3], n, kSymmetric);
    T ahead[kStates2];
    apply<T, C>(F, x, to, n, n);
    congruence<T, C>(F, P, Q, ahead, cov, n, n);
}

struct Predict : shapes::Predict {
    template <class T>
    void run(const In* in, const Out* out) const {
        if constexpr (!std::is_same_v<T, double>)
            if (!are_shared(in, {2, 3})) return solve<T, T>(in, out, n);
        with_sizes(n, [&](auto states) {
            solve<T, std::conditional_t<std::is_same_v<decltype(states), int>, T, double>>(in, out, states);
        });
    }
    template <class T, class C, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T to[kMostStates], cov[kStates2];
        predict_moments<T, C>(in, to, cov, n);
        store(out[0], to, n), store_symmetric(out[1], cov, n);
    }
};

struct Propagate : shapes::Propagate {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        const Square<T> P(in[0], n, kSymmetric), F(in[1], n * n), Q(in[2], n, kSymmetric);
        T ahead[kStates2], cov[kStates2];
        congruence<T, T>(F, P, Q, ahead, cov, n, n);
        store_symmetric(out[0], cov, n);
    }
};

// One return that is the target's: x, P, and log N of the innovation; with `step` also the prediction before it.
struct Update : shapes::Update {
    template <class T>
    void run(const In* in, const Out* out) const {
        if (step)
            with_constants<T, kShared>(n, m, are_shared(in, {2, 3, 5, 6}), [&](auto states, auto measured, auto c) {
                predict_and_update<T, decltype(c)>(in, out, states, measured);
            });
        else
            with_constants<T, kSharedOrOwn>(n, m, are_shared(in, {3, 4}), [&](auto states, auto measured, auto c) {
                update_only<T, decltype(c)>(in, out, states, measured);
            });
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void predict_and_update(const In* in, const Out* out, N n, M m) const {
        T to[kMostStates], cov[kStates2];
        predict_moments<T, C>(in, to, cov, n);
        solve<T, C>(to, cov, in + 4, out, n, m);
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void update_only(const In* in, const Out* out, N n, M m) const {
        const Vector<T> x(in[0], n);
        const Square<T> P(in[1], n, kSymmetric);
        solve<T, C>(x, P, in + 2, out, n, m);
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void solve(const T* x, const T* P, const In* in, const Out* out, N n, M m) const {
        const Vector<T> z(in[0], m);
        const Rectangle<C> H(in[1], m * n);
        const Square<C> R(in[2], m, kSymmetric);
        T nu[kMostMeasured], to[kMostStates], post[kStates2];
        Correction<T> correction;
        correction.template prepare<C>(P, H, R, n, m);
        apply<T, C>(H, x, nu, m, n);
        for (int i = 0; i < m; ++i) nu[i] = z[i] - nu[i];
        correction.template posterior_covariance<C>(P, H, R, post, n, m);
        correction.mean_shift(nu, to, n, m);
        for (int i = 0; i < n; ++i) to[i] += x[i];
        store(out[0], to, n), store_symmetric(out[1], post, n);
        Lane<T>::store(out[2], 0, -0.5 * (correction.squared_distance(nu, m) + correction.log_det + m * kLog2Pi));
    }
};

// in: P, z, expected, H, R, P_D; out: loglik (1+k), distance (k), log volume, shift (k, n), posterior (1|k, n, n)
struct EvaluateReturns : shapes::EvaluateReturns {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_constants<T, kSharedOrOwn>(n, m, are_shared(in, {3, 4}), [&](auto states, auto measured, auto c) {
            solve<T, decltype(c)>(in, out, states, measured);
        });
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n, M m) const {
        const Square<T> P(in[0], n, kSymmetric);
        const Vector<T> expected(in[2], m);
        const Rectangle<C> H(in[3], m * n);
        T nu[kMostMeasured], post[kStates2];
        const T p_detect = Lane<T>::load(in[5], 0);
        Lane<T>::store(out[0], 0, safe_log(1.0 - p_detect * p_gate));
        const T log_detect = safe_log(p_detect);
        T volume = Lane<T>::broadcast(-std::numeric_limits<double>::infinity());
        Correction<T> correction;
        for (int h = 0; h < noises; ++h) {
            const Square<C> R(at_offset(in[4], h * m * m), m, kSymmetric);
            correction.template prepare<C>(P, H, R, n, m);
            correction.template posterior_covariance<C>(P, H, R, post, n, m);
            store_symmetric(at_offset(out[4], h * n * n), post, n);
            volume = Lane<T>::maximum(volume, 0.5 * correction.log_det);
            const T least = log_detect - 0.5 * (correction.log_det + m * kLog2Pi);
            for (int g = noises == 1 ? 0 : h; g < (noises == 1 ? k : h + 1); ++g) {
                load(at_offset(in[1], g * m), nu, m);
                for (int i = 0; i < m; ++i) nu[i] -= expected[i];
                wrap(nu, periods);
                correction.score_residual(nu, least, at_offset(out[0], 1 + g), at_offset(out[1], g), at_offset(out[3], g * n), n, m);
            }
        }
        Lane<T>::store(out[2], 0, volume);
    }
};

struct WeightedUpdate : shapes::WeightedUpdate {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T x[kMostStates], P[kStates2];
        load(in[0], x, n), load_symmetric(in[1], P, n);
        mix_hypotheses(x, P, in[2], in[3], in[4], n, k, shared, periods);
        store(out[0], x, n), store_symmetric(out[1], P, n);
    }
};

}  // namespace vedette::VEDETTE_ISA
