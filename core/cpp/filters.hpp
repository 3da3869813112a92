// The kernels of one filter, for one problem or eight: what reference.py says in numpy.
//
// Letters are the reference's: n state, m measured, k returns. Covariances come out positive semi-definite, as they are sums
// of squares (Joseph's form) wherever digits would cancel otherwise.
#pragma once

#include "square_root.hpp"

namespace vedette::VEDETTE_ISA {

constexpr double kMild = 1e-3;  // the least |R| / |S| at which a covariance is updated by the short form

// What one noise R makes of a predicted P (n, n) seen through H (m, n): H P (m, n), inverse of S, the gain transposed (m, n),
// log |S|, and whether the noise is so large a part of S that P - K S K' keeps its digits (ADR 11); if not, whether S has an
// inverse that does.
template <class T>
struct Sight {
    T cross[kMostMeasured * kMostStates], inverse[kMeasured2], gain[kMostMeasured * kMostStates], log_det;
    Mask<T> sound;
    bool mild;

    template <class C, class N, class M>
    VEDETTE_INLINE void take(const T* P, const C* H, const C* R, N n, M m) {
        stage<T>([=] { look(P, H, R, n, m); });
    }

    template <class C>
    VEDETTE_INLINE void look(const T* P, const C* H, const C* R, int n, int m) {
        T S[kMeasured2];
        congruence(H, P, R, cross, S, m, n);
        log_det = invert(S, inverse, m, sound);
        multiply<kLeft>(inverse, cross, gain, m, m, n);
        mild = false;
        if (m == 1) mild = all_of(R[0] > kMild * S[0]);
        if (m == 2)
            mild = all_of(R[0] * R[3] - R[1] * R[1] >
                          Lane<T>::larger(kMild * (S[0] * S[3] - S[1] * S[1]), kSingular * S[0] * S[3]));
        if (mild) return;
        if (m == 1) sound = S[0] > 0.0;
        if (m == 2) sound = S[0] * S[3] - S[1] * S[1] > kSingular * S[0] * S[3];
        if (!all_of(sound)) take_root<T, C>(P, H, R, nullptr, n, m, sound);
    }

    // The posterior covariance.
    template <class C, class N, class M>
    VEDETTE_INLINE void narrow(const T* P, const C* H, const C* R, T* post, N n, M m) {
        if (mild)
            stage<T>([=] { shorten(P, cross, post, n, m); });
        else
            stage<T>([=] {
                joseph(P, H, R, post, n, m);
                Mask<T> kept;
                pivots_exceed<T>(post, kLeastPivot, P, kLost, n, kept);
                kept = kept & sound;
                if (!all_of(kept)) take_root<T, C>(P, H, R, post, n, m, kept);
            });
    }

    // All of those problems whose digits were not kept, by roots; `post` may be none.
    template <class V, class C>
    __attribute__((noinline, cold)) void take_root(const V* P, const C* H, const C* R, V* post, int n, int m,
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
            take_lane(update, post, n, m, l);
        }
    }

    VEDETTE_INLINE void take_lane(const SquareRootUpdate& update, T* post, int n, int m, int l) {
        for (int i = 0; i < m * m; ++i) set_lane(inverse[i], l, update.inverse[i]);
        for (int i = 0; i < m * n; ++i) set_lane(gain[i], l, update.gain[i]);
        set_lane(log_det, l, update.log_det);
        for (int i = 0; post != nullptr && i < n * n; ++i) set_lane(post[i], l, update.post[i]);
    }

    // P - K L, where that is symmetric: with H P for L the posterior, P - K S K'
    VEDETTE_INLINE void shorten(const T* P, const T* L, T* post, int n, int m) const {
        add_turned_product<-1>(P, gain, L, post, n, m);
    }

    // (I - K H) P (I - K H)' + K R K'
    template <class C, class V>
    VEDETTE_INLINE void joseph(const T* P, const C* H, const V* R, T* post, int n, int m) const {
        T keep[kStates2], kept[kStates2], noisy[kMostMeasured * kMostStates], within[kStates2];  // keep: (I - K H)'
        multiply_turned(H, gain, keep, n, m, n);
        for (int i = 0; i < n * n; ++i) keep[i] = (i % (n + 1) == 0 ? 1.0 : 0.0) - keep[i];
        multiply<kLeft>(P, keep, kept, n, n, n);
        multiply<kLeft>(R, gain, noisy, m, m, n);
        for (int i = 0; i < n * n; ++i) within[i] = T{};
        add_turned_product(within, keep, kept, within, n, n);
        add_turned_product(within, gain, noisy, post, n, m);
    }

    VEDETTE_INLINE T distance(const T* nu, int m) const {
        T total = Lane<T>::all(0.0);
        for (int i = 0; i < m; ++i) {
            T sum = entry(inverse, i, 0, m) * nu[0];
            for (int j = 1; j < m; ++j) sum += entry(inverse, i, j, m) * nu[j];
            total += sum * nu[i];
        }
        return total;
    }

    // Of a residual: log-likelihood, with `least` its part that no residual changes, squared distance, and the mean's shift.
    VEDETTE_INLINE void judge(const T* nu, const T& least, Out loglik, Out squared, Out shifted, int n, int m) const {
        T to[kMostStates];
        const T d = distance(nu, m);
        Lane<T>::store(squared, 0, d);
        Lane<T>::store(loglik, 0, least - 0.5 * d);
        shift(nu, to, n, m);
        store(shifted, to, n);
    }

    // K nu
    VEDETTE_INLINE void shift(const T* nu, T* to, int n, int m) const { multiply(nu, gain, to, 1, m, n); }
};

// Moments of the hypotheses `miss` and 1..k, into x (n) and P (n, n), which are the prior's on entry.
template <class T>
VEDETTE_INLINE void mix(T* x, T* P, In shift, In post, In weights, int n, int k, bool shared, const Periods& periods) {
    T mean[kMostStates], apart[kMostStates], within[kStates2];
    const T miss = Lane<T>::load(weights, 0);
    for (int i = 0; i < n; ++i) mean[i] = Lane<T>::all(0.0);
    T hit = Lane<T>::all(0.0);
    for (int h = 0; h < k; ++h) {
        const T w = Lane<T>::load(weights, 1 + h);
        hit += w;
        load(part(shift, h * n), apart, n);
        for (int i = 0; i < n; ++i) mean[i] += w * apart[i];
    }
    for (int i = 0; i < n; ++i)
        for (int j = i; j < n; ++j) within[i * n + j] = miss * (P[i * n + j] + mean[i] * mean[j]);
    for (int h = 0; h < (shared ? 1 : k); ++h) {
        const T w = shared ? hit : Lane<T>::load(weights, 1 + h);
        load_symmetric(part(post, h * n * n), P, n);
        for (int i = 0; i < n; ++i)
            for (int j = i; j < n; ++j) within[i * n + j] += w * P[i * n + j];
    }
    for (int h = 0; h < k; ++h) {
        const T w = Lane<T>::load(weights, 1 + h);
        load(part(shift, h * n), apart, n);
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
VEDETTE_INLINE void step_ahead(const In* in, T* to, T* cov, N n) {
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
        specialised<T>(n, are_shared(in, {2, 3}), [&](auto states, auto c) { solve<T, decltype(c)>(in, out, states); });
    }
    template <class T, class C, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T to[kMostStates], cov[kStates2];
        step_ahead<T, C>(in, to, cov, n);
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
            specialised<T>(n, m, are_shared(in, {2, 3, 5, 6}), [&](auto states, auto measured, auto c) {
                ahead<T, decltype(c)>(in, out, states, measured);
            });
        else
            specialised<T>(n, m, are_shared(in, {3, 4}), [&](auto states, auto measured, auto c) {
                now<T, decltype(c)>(in, out, states, measured);
            });
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void ahead(const In* in, const Out* out, N n, M m) const {
        T to[kMostStates], cov[kStates2];
        step_ahead<T, C>(in, to, cov, n);
        solve<T, C>(to, cov, in + 4, out, n, m);
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void now(const In* in, const Out* out, N n, M m) const {
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
        Sight<T> sight;
        sight.template take<C>(P, H, R, n, m);
        apply<T, C>(H, x, nu, m, n);
        for (int i = 0; i < m; ++i) nu[i] = z[i] - nu[i];
        sight.template narrow<C>(P, H, R, post, n, m);
        sight.shift(nu, to, n, m);
        for (int i = 0; i < n; ++i) to[i] += x[i];
        store(out[0], to, n), store_symmetric(out[1], post, n);
        Lane<T>::store(out[2], 0, -0.5 * (sight.distance(nu, m) + sight.log_det + m * kLog2Pi));
    }
};

// in: P, z, expected, H, R, P_D; out: loglik (1+k), distance (k), log volume, shift (k, n), posterior (1|k, n, n)
struct InnovateReturns : shapes::InnovateReturns {
    template <class T>
    void run(const In* in, const Out* out) const {
        specialised<T>(n, m, are_shared(in, {3, 4}), [&](auto states, auto measured, auto c) {
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
        T volume = Lane<T>::all(-std::numeric_limits<double>::infinity());
        Sight<T> sight;
        for (int h = 0; h < noises; ++h) {
            const Square<C> R(part(in[4], h * m * m), m, kSymmetric);
            sight.template take<C>(P, H, R, n, m);
            sight.template narrow<C>(P, H, R, post, n, m);
            store_symmetric(part(out[4], h * n * n), post, n);
            volume = Lane<T>::larger(volume, 0.5 * sight.log_det);
            const T least = log_detect - 0.5 * (sight.log_det + m * kLog2Pi);
            for (int g = noises == 1 ? 0 : h; g < (noises == 1 ? k : h + 1); ++g) {
                load(part(in[1], g * m), nu, m);
                for (int i = 0; i < m; ++i) nu[i] -= expected[i];
                wrap(nu, periods);
                sight.judge(nu, least, part(out[0], 1 + g), part(out[1], g), part(out[3], g * n), n, m);
            }
        }
        Lane<T>::store(out[2], 0, volume);
    }
};

struct Absorb : shapes::Absorb {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T x[kMostStates], P[kStates2];
        load(in[0], x, n), load_symmetric(in[1], P, n);
        mix(x, P, in[2], in[3], in[4], n, k, shared, periods);
        store(out[0], x, n), store_symmetric(out[1], P, n);
    }
};

}  // namespace vedette::VEDETTE_ISA
