// The kernels of one filter, for one problem or eight: what reference.py says in numpy.
//
// Letters are the reference's: n state, m measured, k returns. Covariances come out positive semi-definite, as they are sums
// of squares (Joseph's form).
#pragma once

#include "algebra.hpp"

namespace vedette::VEDETTE_ISA {

VEDETTE_INLINE In part(In a, std::ptrdiff_t from) { return {a.at + from, a.next}; }
VEDETTE_INLINE Out part(Out a, std::ptrdiff_t from) { return {a.at + from, a.next}; }

// What one noise R makes of a predicted P (n, n) seen through H (m, n): inverse of S, the gain transposed (m, n), log |S|.
template <class T>
struct Sight {
    T inverse[kMeasured2], gain[kMostMeasured * kMostStates], log_det;

    template <class C, class N, class M>
    VEDETTE_INLINE void take(const T* P, const C* H, const C* R, N n, M m) {
        stage<T>([=] { look(P, H, R, n, m); });
    }

    template <class C>
    VEDETTE_INLINE void look(const T* P, const C* H, const C* R, int n, int m) {
        T cross[kMostMeasured * kMostStates], S[kMeasured2];
        multiply<kRight>(H, P, cross, m, n, n);
        for (int i = 0; i < m * m; ++i) S[i] = T{} + R[i];
        make_symmetric(S, m);
        for (int i = 0; i < m; ++i)
            for (int j = i; j < m; ++j) {
                T sum = S[i * m + j];
                for (int l = 0; l < n; ++l) sum += cross[i * n + l] * H[j * n + l];
                S[i * m + j] = S[j * m + i] = sum;
            }
        log_det = invert(S, inverse, m);
        multiply(inverse, cross, gain, m, m, n);
    }

    // The posterior covariance, (I - K H) P (I - K H)' + K R K'.
    template <class C, class V, class N, class M>
    VEDETTE_INLINE void joseph(const T* P, const C* H, const V* R, T* post, N n, M m) const {
        stage<T>([=] { narrow(P, H, R, post, n, m); });
    }

    template <class C, class V>
    VEDETTE_INLINE void narrow(const T* P, const C* H, const V* R, T* post, int n, int m) const {
        T keep[kStates2], kept[kStates2], noisy[kMostMeasured * kMostStates];  // keep: (I - K H)'
        multiply_turned(H, gain, keep, n, m, n);
        for (int i = 0; i < n * n; ++i) keep[i] = (i % (n + 1) == 0 ? 1.0 : 0.0) - keep[i];
        multiply<kLeft>(P, keep, kept, n, n, n);
        multiply(R, gain, noisy, m, m, n);
        for (int i = 0; i < n * n; ++i) post[i] = Lane<T>::all(0.0);
        add_turned_product(keep, kept, post, n, n);
        add_turned_product(gain, noisy, post, n, m);
    }

    VEDETTE_INLINE T distance(const T* nu, int m) const {
        T total = Lane<T>::all(0.0);
        for (int i = 0; i < m; ++i) {
            T sum = inverse[i * m] * nu[0];
            for (int j = 1; j < m; ++j) sum += inverse[i * m + j] * nu[j];
            total += sum * nu[i];
        }
        return total;
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
        for (int j = i; j < n; ++j) within[i * n + j] = miss * (0.5 * (P[i * n + j] + P[j * n + i]) + mean[i] * mean[j]);
    for (int h = 0; h < (shared ? 1 : k); ++h) {
        const T w = shared ? hit : Lane<T>::load(weights, 1 + h);
        load(part(post, h * n * n), P, n * n);
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
        for (int j = i; j < n; ++j) P[i * n + j] = P[j * n + i] = within[i * n + j];
    }
    wrap(x, periods);
}

// The matrices of a motion: F transposed, and Q.
template <class C>
struct Step {
    C turned[kStates2], Q[kStates2];

    VEDETTE_INLINE Step(In F_in, In Q_in, int n) {
        C F[kStates2];
        load(F_in, F, n * n), load(Q_in, Q, n * n);
        transpose(F, turned, n, n);
        make_symmetric(Q, n);
    }

    // F x and F P F' + Q
    template <class T>
    VEDETTE_INLINE void predict(const T* x, const T* P, T* to, T* cov, int n) const {
        multiply(x, turned, to, 1, n, n);
        propagated(P, turned, Q, cov, n);
    }
};

struct Predict : shapes::Predict {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, [&](auto states) {
            with_coefficients<T>(states, {in[2], in[3]}, [&](auto c) { solve<T, decltype(c)>(in, out, states); });
        });
    }
    template <class T, class C, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T x[kMostStates], P[kStates2], to[kMostStates], cov[kStates2];
        const Step<C> step(in[2], in[3], n);
        load(in[0], x, n), load(in[1], P, n * n);
        step.predict(x, P, to, cov, n);
        store(out[0], to, n), store(out[1], cov, n * n);
    }
};

struct Propagate : shapes::Propagate {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T P[kStates2], cov[kStates2];
        const Step<T> step(in[1], in[2], n);
        load(in[0], P, n * n);
        propagated(P, step.turned, step.Q, cov, n);
        store(out[0], cov, n * n);
    }
};

// One return that is the target's: x, P, and log N of the innovation; with `step` also the prediction before it.
struct Update : shapes::Update {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, m, [&](auto states, auto measured) {
            if (step)
                with_coefficients<T>(states, {in[2], in[3], in[5], in[6]},
                                     [&](auto c) { ahead<T, decltype(c)>(in, out, states, measured); });
            else
                with_coefficients<T>(states, {in[3], in[4]}, [&](auto c) { now<T, decltype(c)>(in, out, states, measured); });
        });
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void ahead(const In* in, const Out* out, N n, M m) const {
        T x[kMostStates], P[kStates2], to[kMostStates], cov[kStates2];
        const Step<C> step(in[2], in[3], n);
        load(in[0], x, n), load(in[1], P, n * n);
        step.predict(x, P, to, cov, n);
        solve<T, C>(to, cov, in + 4, out, n, m);
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void now(const In* in, const Out* out, N n, M m) const {
        T x[kMostStates], P[kStates2];
        load(in[0], x, n), load(in[1], P, n * n);
        solve<T, C>(x, P, in + 2, out, n, m);
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void solve(const T* x, const T* P, const In* in, const Out* out, N n, M m) const {
        T z[kMostMeasured], nu[kMostMeasured], to[kMostStates], post[kStates2];
        C H[kMostMeasured * kMostStates], R[kMeasured2];
        load(in[0], z, m), load(in[1], H, m * n), load(in[2], R, m * m);
        Sight<T> sight;
        sight.take(P, H, R, n, m);
        for (int i = 0; i < m; ++i) {
            nu[i] = z[i];
            for (int j = 0; j < n; ++j) nu[i] -= H[i * n + j] * x[j];
        }
        sight.shift(nu, to, n, m);
        for (int i = 0; i < n; ++i) to[i] += x[i];
        sight.joseph(P, H, R, post, n, m);
        store(out[0], to, n), store(out[1], post, n * n);
        Lane<T>::store(out[2], 0, -0.5 * (sight.distance(nu, m) + sight.log_det + m * kLog2Pi));
    }
};

// in: P, z, expected, H, R, P_D; out: loglik (1+k), distance (k), log volume, shift (k, n), posterior (1|k, n, n)
struct InnovateReturns : shapes::InnovateReturns {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, m, [&](auto states, auto measured) {
            with_coefficients<T>(states, {in[3], in[4]}, [&](auto c) { solve<T, decltype(c)>(in, out, states, measured); });
        });
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n, M m) const {
        T P[kStates2], expected[kMostMeasured], nu[kMostMeasured], shift[kMostStates], post[kStates2];
        C H[kMostMeasured * kMostStates], R[kMeasured2];
        load(in[0], P, n * n), load(in[2], expected, m), load(in[3], H, m * n);
        const T p_detect = Lane<T>::load(in[5], 0);
        Lane<T>::store(out[0], 0, safe_log(1.0 - p_detect * p_gate));
        const T log_detect = safe_log(p_detect);
        T volume = Lane<T>::all(-std::numeric_limits<double>::infinity());
        Sight<T> sight;
        for (int h = 0; h < noises; ++h) {
            load(part(in[4], h * m * m), R, m * m);
            sight.take(P, H, R, n, m);
            sight.joseph(P, H, R, post, n, m);
            store(part(out[4], h * n * n), post, n * n);
            volume = Lane<T>::larger(volume, 0.5 * sight.log_det);
            const T least = log_detect - 0.5 * (sight.log_det + m * kLog2Pi);
            for (int g = noises == 1 ? 0 : h; g < (noises == 1 ? k : h + 1); ++g) {
                load(part(in[1], g * m), nu, m);
                for (int i = 0; i < m; ++i) nu[i] -= expected[i];
                wrap(nu, periods);
                const T distance = sight.distance(nu, m);
                Lane<T>::store(out[1], g, distance);
                Lane<T>::store(out[0], 1 + g, least - 0.5 * distance);
                sight.shift(nu, shift, n, m);
                store(part(out[3], g * n), shift, n);
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
        load(in[0], x, n), load(in[1], P, n * n);
        mix(x, P, in[2], in[3], in[4], n, k, shared, periods);
        store(out[0], x, n), store(out[1], P, n * n);
    }
};

}  // namespace vedette::VEDETTE_ISA
