// The kernels of one filter, for one problem or eight: what reference.py says in numpy.
//
// Letters are the reference's: n state, m measured, k returns. Covariances come out positive semi-definite, as they are sums
// of squares (Joseph's form) wherever digits would cancel otherwise.
#pragma once

#include "square_root.hpp"

namespace vedette::VEDETTE_ISA {

constexpr double kLeastNoiseShare = 1e-3;  // the least part of S that R is where a covariance is updated by the short form

// What one noise R makes of a predicted P (n, n) seen through H (m, n): H P (m, n), inverse of S, the gain transposed (m, n),
// log |S|, and whether the noise is so large a part of S that P - K S K' keeps its digits (ADR 11); if not, whether S has an
// inverse that does.
template <class T>
struct Correction {
    T cross[kMostMeasured * kMostStates], inverse[kMeasured2], gain[kMostMeasured * kMostStates], log_det;
    Mask<T> is_regular;
    bool keeps_digits;

    template <class C, class N, class M>
    VEDETTE_INLINE void prepare(const T* P, const C* H, const C* R, N n, M m) {
        outlined_for_eight<T, N, M>([=] { compute(P, H, R, n, m); });
    }

    template <class C, class N, class M>
    VEDETTE_INLINE void compute(const T* P, const C* H, const C* R, N n, M m) {
        T S[kMeasured2];
        congruence(H, P, R, cross, S, m, n);
        Mask<T> is_independent;
        log_det = invert(S, inverse, m, is_regular, is_independent);
        multiply<kLeft>(inverse, cross, gain, m, m, n);
        keeps_digits = false;
        if (m == 1) keeps_digits = all_of(R[0] > kLeastNoiseShare * S[0]);
        if (m == 2)
            keeps_digits =
                all_of((R[0] * R[3] - R[1] * R[1] > kLeastNoiseShare * (S[0] * S[3] - S[1] * S[1])) &
                       (S[0] * S[3] - S[1] * S[1] > kLeastIndependence * S[0] * S[3]));
        if (m > 2) keeps_digits = all_of(is_independent) && exceeds_part(R, S, kLeastNoiseShare, m);
        if (keeps_digits) return;
        if (m == 1) is_regular = S[0] > 0.0;
        if (m == 2) is_regular = S[0] * S[3] - S[1] * S[1] > kSingular * S[0] * S[3];
        if (!all_of(is_regular)) recompute_by_square_root<T, C>(P, H, R, nullptr, n, m, is_regular);
    }

    // The posterior covariance.
    template <class C, class N, class M>
    VEDETTE_INLINE void posterior_covariance(const T* P, const C* H, const C* R, T* post, N n, M m) {
        if (keeps_digits)
            outlined_for_eight<T, N, M>([=] { short_form(P, cross, post, n, m); });
        else
            outlined_for_eight<T, N, M>([=] {
                Mask<T> kept;
                joseph_form(P, H, R, post, n, m, kept);
                if (!all_of(kept & is_regular) && !keeps_pivots(P, post, n, kept))
                    recompute_by_square_root<T, C>(P, H, R, post, n, m, kept);
            });
    }

    // Whether a covariance that Joseph's form has made keeps its digits after all, and which problems' do.
    __attribute__((noinline)) bool keeps_pivots(const T* P, const T* post, int n, Mask<T>& kept) const {
        pivots_exceed<T>(post, kLeastPivot, P, kLost, n, kept);
        kept = kept & is_regular;
        return all_of(kept);
    }

    // All of those problems whose digits were not kept, by roots; `post` may be none.
    template <class V, class C>
    __attribute__((noinline, cold)) void recompute_by_square_root(const V* P, const C* H, const C* R, V* post, int n, int m,
                                                                 const Mask<V>& kept) {
        for (int l = 0; l < Lane<T>::count; ++l) {
            if (is_set(kept, l)) continue;
            SquareRootUpdate update;
            double own[kStates2], rows[kStates2], noise[kMeasured2];
            for (int i = 0; i < n; ++i)
                for (int j = i; j < n; ++j) own[i * n + j] = lane(P[i * n + j], l);
            for (int i = 0; i < m; ++i)
                for (int j = i; j < m; ++j) noise[i * m + j] = lane(R[i * m + j], l);
            bounded_root(own, rows, n);
            for (int p = 0; p < n; ++p) {
                for (int j = 0; j < n; ++j) update.A[m + p][m + j] = rows[p * n + j];
                for (int i = 0; i < m; ++i)
                    for (int j = 0; j < n; ++j) update.A[m + p][i] += rows[p * n + j] * lane(H[i * n + j], l);
            }
            update.solve(noise, n, n, m);
            set_problem(update, post, n, m, l);
        }
    }

    VEDETTE_INLINE void set_problem(const SquareRootUpdate& update, T* post, int n, int m, int l) {
        for (int i = 0; i < m * m; ++i) set_lane(inverse[i], l, update.inverse[i]);
        for (int i = 0; i < m * n; ++i) set_lane(gain[i], l, update.gain[i]);
        set_lane(log_det, l, update.log_det);
        for (int i = 0; post != nullptr && i < n * n; ++i) set_lane(post[i], l, update.post[i]);
    }

    // P - K L, where that is symmetric: with H P for L the posterior, P - K S K'
    template <class N, class M>
    VEDETTE_INLINE void short_form(const T* P, const T* L, T* post, N n, M m) const {
        add_transposed_product<-1>(P, gain, L, post, n, m);
    }

    // (I - K H) P (I - K H)' + K R K', and where its terms are so small that no digit to speak of cancels.
    template <class C, class V, class N, class M>
    VEDETTE_INLINE void joseph_form(const T* P, const C* H, const V* R, T* post, N n, M m, Mask<T>& kept) const {
        T keep[kStates2], narrowed[kStates2], noisy[kMostMeasured * kMostStates], within[kStates2];  // keep: (I - K H)'
        multiply<kTransposed>(H, gain, keep, n, m, n);
        for (int i = 0; i < n * n; ++i) keep[i] = (i % (n + 1) == 0 ? 1.0 : 0.0) - keep[i];
        multiply<kLeft>(P, keep, narrowed, n, n, n);
        multiply<kLeft>(R, gain, noisy, m, m, n);
        for (int i = 0; i < n * n; ++i) within[i] = T{};
        add_transposed_product(within, keep, narrowed, within, n, n);
        add_transposed_product(within, gain, noisy, post, n, m);
        kept = T{} == 0.0;
        for (int i = 0; i < n; ++i) {
            T terms{};
            for (int j = 0; j < n; ++j) terms += keep[j * n + i] * keep[j * n + i] * P[j * n + j];
            kept = kept & (terms <= kMostCancelled * post[i * n + i]);
        }
    }

    VEDETTE_INLINE T squared_distance(const T* nu, int m) const {
        T total = Lane<T>::broadcast(0.0);
        for (int i = 0; i < m; ++i) {
            T sum = entry(inverse, i, 0, m) * nu[0];
            for (int j = 1; j < m; ++j) sum += entry(inverse, i, j, m) * nu[j];
            total += sum * nu[i];
        }
        return total;
    }

    // Of a residual: log-likelihood, with `least` its part that no residual changes, squared distance, and the mean's shift.
    template <class N, class M>
    VEDETTE_INLINE void score_residual(const T* nu, const T& least, Out loglik, Out squared, Out shifted, N n, M m) const {
        T to[kMostStates];
        const T d = squared_distance(nu, m);
        Lane<T>::store(squared, 0, d);
        Lane<T>::store(loglik, 0, least - 0.5 * d);
        mean_shift(nu, to, n, m);
        store(shifted, to, n);
    }

    // K nu
    template <class N, class M>
    VEDETTE_INLINE void mean_shift(const T* nu, T* to, N n, M m) const {
        once_unless_constant<N, M>([=]() VEDETTE_INLINED { multiply(nu, gain, to, kOne, m, n); });
    }
};

// Moments of the hypotheses `miss` and 1..k, into x (n) and P (n, n), which are the prior's on entry.
template <class T, class N>
VEDETTE_INLINE void mix_hypotheses(T* x, T* P, In shift, In post, In weights, N n, int k, bool shared, const Periods& periods) {
    T mean[kMostStates], apart[kMostStates], within[kStates2];
    const T miss = Lane<T>::load(weights, 0);
    for (int i = 0; i < n; ++i) mean[i] = Lane<T>::broadcast(0.0);
    T hit = Lane<T>::broadcast(0.0);
    for (int h = 0; h < k; ++h) {
        const T w = Lane<T>::load(weights, 1 + h);
        hit += w;
        load(at_offset(shift, h * n), apart, n);
        for (int i = 0; i < n; ++i) mean[i] += w * apart[i];
    }
    for (int i = 0; i < n; ++i)
        for (int j = i; j < n; ++j) within[i * n + j] = miss * (P[i * n + j] + mean[i] * mean[j]);
    for (int h = 0; h < (shared ? 1 : k); ++h) {
        const T w = shared ? hit : Lane<T>::load(weights, 1 + h);
        load_symmetric(at_offset(post, h * n * n), P, n);
        for (int i = 0; i < n; ++i)
            for (int j = i; j < n; ++j) within[i * n + j] += w * P[i * n + j];
    }
    for (int h = 0; h < k; ++h) {
        const T w = Lane<T>::load(weights, 1 + h);
        load(at_offset(shift, h * n), apart, n);
        for (int i = 0; i < n; ++i) apart[i] -= mean[i];
        for (int i = 0; i < n; ++i) {
            const T scaled = w * apart[i];
            for (int j = i; j < n; ++j) within[i * n + j] += scaled * apart[j];
        }
    }
    for (int i = 0; i < n; ++i) {
        x[i] += mean[i];
        for (int j = i; j < n; ++j) set_entry(P, i, j, n, within[i * n + j]);
    }
    wrap(x, periods);
}

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
