// A scan's whole step of a track that surely exists, without the memory between its stages.
#pragma once

#include "filters.hpp"

namespace vedette::VEDETTE_ISA {

// The same of a single return, `post` being the covariance under it: with the weights p and q = 1 - p and the shift s the mixture
// is P' = q P + p post + p q s s'.
template <class T, class Shape, class N, class M>
VEDETTE_INLINE void take_one_return(const Shape& shape, const Correction<T>& correction, T* x, const T* P, T* post, const T* expected,
                                    const T& log_miss, const T& least, const In& z, const Out* out, N n, M m) {
    T nu[kMostMeasured], shift[kMostStates], weights[2];
    load(z, nu, m);
    for (int i = 0; i < m; ++i) nu[i] -= expected[i];
    wrap(nu, shape.periods);
    const T d = correction.squared_distance(nu, m), none = least - std::numeric_limits<double>::infinity();
    const T gained = (d <= shape.limit ? least - 0.5 * d : none) - log_miss;
    Lane<T>::store(out[3], 0, d);
    if (shape.best) {
        weights[1] = gained > 0.0 ? 1.0 - T{} : T{};
        weights[0] = 1.0 - weights[1];
    } else {
        const T lesser = Lane<T>::exp(gained > 0.0 ? -gained : gained), likelier = 1.0 / (1.0 + lesser);
        const T unlikelier = normal_or_zero(lesser * likelier);
        weights[1] = gained > 0.0 ? likelier : unlikelier;
        weights[0] = gained > 0.0 ? unlikelier : likelier;
    }
    store(out[2], weights, 2);
    correction.mean_shift(nu, shift, n, m);
    const T both = weights[0] * weights[1];
    for (int i = 0; i < n; ++i) {
        x[i] += weights[1] * shift[i];
        const T scaled = both * shift[i];
        for (int j = i; j < n; ++j)
            set_entry(post, i, j, n, T(weights[0] * P[i * n + j] + (weights[1] * post[i * n + j] + scaled * shift[j])));
    }
    store(out[0], x, n), store_symmetric(out[1], post, n);
}

// What the returns z (k, m) of a scan make of a predicted track x, P that surely exists: scores, weights and the mixture, as other
// kernels say one after another, without the memory between. out: x, P, weights (1+k), squared distances (k).
template <class T, class C, class Shape, class N, class M>
VEDETTE_INLINE void take_returns(const Shape& shape, T* x, const T* P, const C* H, const C* R, const T* expected, const T& log_miss,
                                 const T& log_detect, const In& z, const Out* out, N n, M m) {
    const int k = shape.k;
    T post[kStates2], nu[kMostMeasured], weights[1 + kMostTaken], shift[kMostTaken * kMostStates], mean[kMostStates];
    Correction<T> correction;
    correction.template prepare<C>(P, H, R, n, m);
    correction.template posterior_covariance<C>(P, H, R, post, n, m);
    const T least = log_detect - 0.5 * (correction.log_det + m * kLog2Pi), none = least - std::numeric_limits<double>::infinity();
    if (k == 1) return take_one_return(shape, correction, x, P, post, expected, log_miss, least, z, out, n, m);
    T top = weights[0] = log_miss, first{}, total{}, hit{};
    for (int h = 0; h < k; ++h) {
        load(at_offset(z, h * m), nu, m);
        for (int i = 0; i < m; ++i) nu[i] -= expected[i];
        wrap(nu, shape.periods);
        const T d = correction.squared_distance(nu, m), score = least - 0.5 * d;
        Lane<T>::store(out[3], h, d);
        weights[1 + h] = d <= shape.limit ? score : none;
        first = weights[1 + h] > top ? 1.0 + h - T{} : first;
        top = weights[1 + h] > top ? weights[1 + h] : top;
        correction.mean_shift(nu, shift + h * n, n, m);
    }
    for (int h = 0; h <= k; ++h)
        total += weights[h] = shape.best ? (first == h ? 1.0 - T{} : T{}) : Lane<T>::exp(weights[h] - top);
    for (int h = 0; h <= k; ++h) weights[h] = normal_or_zero(weights[h] / total);
    store(out[2], weights, 1 + k);
    for (int i = 0; i < n; ++i) mean[i] = T{};
    for (int h = 0; h < k; ++h) {
        hit += weights[1 + h];
        for (int i = 0; i < n; ++i) mean[i] += weights[1 + h] * shift[h * n + i];
    }
    for (int i = 0; i < n; ++i)
        for (int j = i; j < n; ++j) post[i * n + j] = weights[0] * (P[i * n + j] + mean[i] * mean[j]) + hit * post[i * n + j];
    for (int h = 0; h < k; ++h) {
        T* const apart = shift + h * n;
        for (int i = 0; i < n; ++i) apart[i] -= mean[i];
        for (int i = 0; i < n; ++i) {
            const T scaled = weights[1 + h] * apart[i];
            for (int j = i; j < n; ++j) post[i * n + j] += scaled * apart[j];
        }
    }
    for (int i = 0; i < n; ++i) {
        x[i] += mean[i];
        for (int j = i; j < n; ++j) set_entry(post, i, j, n, post[i * n + j]);
    }
    store(out[0], x, n), store_symmetric(out[1], post, n);
}

// in: x, P, F, Q, z (k, m), H, R
struct ScanStep : shapes::ScanStep {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_usual_constants<T>(n, m, are_shared(in, {2, 3, 5, 6}), [&](auto states, auto measured, auto c) {
            solve<T, decltype(c)>(in, out, states, measured);
        });
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n, M m) const {
        T x[kMostStates], P[kStates2], expected[kMostMeasured];
        predict_moments<T, C>(in, x, P, n);
        const Rectangle<C> H(in[5], m * n);
        const Square<C> R(in[6], m, kSymmetric);
        apply<T, C>(H, x, expected, m, n);
        take_returns<T, C>(*this, x, P, H, R, expected, Lane<T>::broadcast(log_miss), Lane<T>::broadcast(log_detect), in[4], out, n, m);
    }
};

// in: x, P, F, Q, z (k, m), the sensor's parameters. Eight states lie side by side here as its twin takes them.
struct ScanStepTwin : shapes::ScanStepTwin {
    mutable double p_detect = -1.0, log_miss = 0.0, log_detect = 0.0;  // the last, as most sensors have one

    template <class T>
    void run(const In* in, const Out* out) const {
        with_usual_constants<T>(n, m, are_shared(in, {2, 3}), [&](auto states, auto measured, auto c) {
            solve<T, decltype(c)>(in, out, states, measured);
        });
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n, M m) const {
        T x[kMostStates], P[kStates2], seen[kMostStates], own[kMostParameters], expected[kMostMeasured], R[kMeasured2], detects;
        T slope[kMostMeasured * kMostStates], H[kMostMeasured * kMostStates];
        predict_moments<T, C>(in, x, P, n);
        for (int a = 0; a < observed; ++a) seen[a] = x[axes[a]];
        for (int a = 0; a < parameters; ++a) own[a] = Lane<T>::load(in[5], a);
        const auto numbers = [](T* of) { return reinterpret_cast<double*>(of); };
        function(Lane<T>::count, numbers(seen), numbers(own), numbers(expected), numbers(slope), numbers(R), numbers(&detects), data);
        for (int a = 0; a < n; ++a)
            for (int i = 0; i < m; ++i) H[i * n + a] = column[a] < 0 ? T{} : slope[i * observed + column[a]];
        T missed = Lane<T>::broadcast(log_miss), detected = Lane<T>::broadcast(log_detect);
        if (!all_of(detects == p_detect)) {
            missed = safe_log(1.0 - detects * p_gate), detected = safe_log(detects) - log_density;
            p_detect = lane(detects, 0), log_miss = lane(missed, 0), log_detect = lane(detected, 0);
        }
        take_returns<T, T>(*this, x, P, H, R, expected, missed, detected, in[4], out, n, m);
    }
};
}  // namespace vedette::VEDETTE_ISA
