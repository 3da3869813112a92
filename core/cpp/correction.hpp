// What a return makes of one problem or eight: gain, innovation, likelihood, and the moments of several hypotheses. Covariances
// come out positive semi-definite, as they are sums of squares (Joseph's form) wherever digits would cancel otherwise.
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
}  // namespace vedette::VEDETTE_ISA
