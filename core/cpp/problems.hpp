// The kernels, each for one problem (or eight): what reference.py, modes.py and association.py say in numpy.
//
// Letters are the reference's: n state, m measured, k returns, r modes. Matrices are row-major. Covariances come out
// symmetric, as their upper triangles are mirrored, and positive semi-definite, as they are sums of squares (Joseph's form).
#pragma once

#include <cstring>
#include <type_traits>

#include "lanes.hpp"

namespace vedette::VEDETTE_ISA {

#define VEDETTE_INLINE __attribute__((always_inline)) inline

// Calls f with the sizes as constants where they are common, so that the compiler unrolls; else as they are.
template <class F>
VEDETTE_INLINE void with_sizes(int n, const F& f) {
    switch (n) {
        case 2: return f(std::integral_constant<int, 2>());
        case 4: return f(std::integral_constant<int, 4>());
        case 5: return f(std::integral_constant<int, 5>());
        case 6: return f(std::integral_constant<int, 6>());
        default: return f(n);
    }
}
template <class F>
VEDETTE_INLINE void with_sizes(int n, int m, const F& f) {
    if (m == 2)
        with_sizes(n, [&](auto states) { f(states, std::integral_constant<int, 2>()); });
    else if (m == 1)
        with_sizes(n, [&](auto states) { f(states, std::integral_constant<int, 1>()); });
    else
        f(n, m);
}

constexpr double kLog2Pi = 1.8378770664093454836;
constexpr double kTiny = 2.2250738585072014e-308;

template <class T>
VEDETTE_INLINE void load(In a, T* to, int count) {
    for (int i = 0; i < count; ++i) to[i] = Lane<T>::load(a, i);
}

template <class T>
VEDETTE_INLINE void store(Out a, const T* from, int count) {
    for (int i = 0; i < count; ++i) Lane<T>::store(a, i, from[i]);
}

template <class T>
VEDETTE_INLINE void wrap(T* x, const Periods& periods) {
    for (int i = 0; i < periods.count; ++i) {
        T& value = x[periods.each[i].axis];
        value = Lane<T>::wrap(value, periods.each[i].period);
    }
}

template <class T>
VEDETTE_INLINE T safe_log(T p) {
    return Lane<T>::log(Lane<T>::larger(p, Lane<T>::all(kTiny)));
}

// A row of four numbers: with four columns, one problem by itself is worked on row by row.
typedef double Row __attribute__((vector_size(32)));
constexpr int kRow = 4;

VEDETTE_INLINE Row row_of(const double* at) {
    Row row;
    std::memcpy(&row, at, sizeof row);
    return row;
}
VEDETTE_INLINE void set_row(double* at, Row row) { std::memcpy(at, &row, sizeof row); }

// A (p, s) B (s, 4) + C (p, 4), or without C
VEDETTE_INLINE void multiply_rows(const double* A, const double* B, double* C, int p, int s, bool add) {
    for (int i = 0; i < p; ++i) {
        Row sum = A[i * s] * row_of(B);
        if (add) sum += row_of(C + i * kRow);
        for (int l = 1; l < s; ++l) sum += A[i * s + l] * row_of(B + l * kRow);
        set_row(C + i * kRow, sum);
    }
}

// C (p, q) = A (p, s) B (s, q)
template <class T>
VEDETTE_INLINE void multiply(const T* A, const T* B, T* C, int p, int s, int q) {
    if constexpr (std::is_same_v<T, double>)
        if (__builtin_constant_p(q) && q == kRow) return multiply_rows(A, B, C, p, s, false);
    for (int i = 0; i < p; ++i)
        for (int j = 0; j < q; ++j) {
            T sum = A[i * s] * B[j];
            for (int l = 1; l < s; ++l) sum += A[i * s + l] * B[l * q + j];
            C[i * q + j] = sum;
        }
}

// C (p, p) += A (p, s) B (p, s)' where that is symmetric: the upper triangle, mirrored
template <class T>
VEDETTE_INLINE void add_product(const T* A, const T* B, T* C, int p, int s) {
    if constexpr (std::is_same_v<T, double>)
        if (__builtin_constant_p(p) && p == kRow) {
            double turned[kRow * kMostStates];
            for (int j = 0; j < p; ++j)
                for (int l = 0; l < s; ++l) turned[l * p + j] = B[j * s + l];
            multiply_rows(A, turned, C, p, s, true);
            for (int i = 0; i < p; ++i)
                for (int j = i + 1; j < p; ++j) C[j * p + i] = C[i * p + j];
            return;
        }
    for (int i = 0; i < p; ++i)
        for (int j = i; j < p; ++j) {
            T sum = C[i * p + j];
            for (int l = 0; l < s; ++l) sum += A[i * s + l] * B[j * s + l];
            C[i * p + j] = C[j * p + i] = sum;
        }
}

template <class T>
VEDETTE_INLINE void make_symmetric(T* A, int n) {
    for (int i = 0; i < n; ++i)
        for (int j = i + 1; j < n; ++j) A[i * n + j] = A[j * n + i] = 0.5 * (A[i * n + j] + A[j * n + i]);
}

// F x and F P F' + Q
template <class T>
VEDETTE_INLINE void predicted(const T* x, const T* P, const T* F, const T* Q, T* x_out, T* P_out, int n) {
    T FP[kStates2];
    multiply(F, x, x_out, n, n, 1);
    multiply(F, P, FP, n, n, n);
    for (int i = 0; i < n * n; ++i) P_out[i] = Q[i];
    make_symmetric(P_out, n);
    add_product(FP, F, P_out, n, n);
}

// The inverse of a positive definite S (m, m), and the logarithm of its determinant.
template <class T>
VEDETTE_INLINE T invert(const T* S, T* inverse, int m) {
    if (m == 1) {
        inverse[0] = 1.0 / S[0];
        return Lane<T>::log(S[0]);
    }
    if (m == 2) {
        const T d1 = S[0], slope = S[2] / d1, d2 = S[3] - slope * S[2];
        inverse[3] = 1.0 / d2;
        inverse[1] = inverse[2] = -slope / d2;
        inverse[0] = 1.0 / d1 + slope * slope / d2;
        return Lane<T>::log(d1 * d2);
    }
    // S = L D L' with a unit lower triangular L; then the inverse of L by substitution.
    T L[kMeasured2], D[kMostMeasured], M[kMeasured2];
    T log_det = Lane<T>::all(0.0);
    for (int j = 0; j < m; ++j) {
        D[j] = S[j * m + j];
        for (int l = 0; l < j; ++l) D[j] -= L[j * m + l] * L[j * m + l] * D[l];
        log_det += Lane<T>::log(D[j]);
        for (int i = j + 1; i < m; ++i) {
            T sum = S[i * m + j];
            for (int l = 0; l < j; ++l) sum -= L[i * m + l] * L[j * m + l] * D[l];
            L[i * m + j] = sum / D[j];
        }
    }
    for (int j = 0; j < m; ++j) {
        M[j * m + j] = Lane<T>::all(1.0);
        for (int i = j + 1; i < m; ++i) {
            T sum = -L[i * m + j];
            for (int l = j + 1; l < i; ++l) sum -= L[i * m + l] * M[l * m + j];
            M[i * m + j] = sum;
        }
    }
    for (int i = 0; i < m; ++i)
        for (int j = i; j < m; ++j) {
            T sum = Lane<T>::all(0.0);
            for (int l = j; l < m; ++l) sum += M[l * m + i] * M[l * m + j] / D[l];
            inverse[i * m + j] = inverse[j * m + i] = sum;
        }
    return log_det;
}

// What one noise R makes of a predicted P (n, n) seen through H (m, n): gain (n, m), inverse of S, posterior, log |S|.
template <class T>
struct Sight {
    T inverse[kMeasured2], gain[kMostStates * kMostMeasured], post[kStates2];
    T log_det;

    VEDETTE_INLINE void take(const T* P, const T* H, const T* R, int n, int m) {
        T cross[kMostStates * kMostMeasured], S[kMeasured2];
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < m; ++j) {
                T sum = P[i * n] * H[j * n];
                for (int l = 1; l < n; ++l) sum += P[i * n + l] * H[j * n + l];
                cross[i * m + j] = sum;
            }
        for (int i = 0; i < m * m; ++i) S[i] = R[i];
        make_symmetric(S, m);
        for (int i = 0; i < m; ++i)
            for (int j = i; j < m; ++j) {
                T sum = S[i * m + j];
                for (int l = 0; l < n; ++l) sum += H[i * n + l] * cross[l * m + j];
                S[i * m + j] = S[j * m + i] = sum;
            }
        log_det = invert(S, inverse, m);
        multiply(cross, inverse, gain, n, m, m);
        joseph(P, H, R, n, m);
    }

    VEDETTE_INLINE void joseph(const T* P, const T* H, const T* R, int n, int m) {
        T keep[kStates2], kept[kStates2], GR[kMostStates * kMostMeasured];
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) {
                T sum = Lane<T>::all(i == j ? 1.0 : 0.0);
                for (int l = 0; l < m; ++l) sum -= gain[i * m + l] * H[l * n + j];
                keep[i * n + j] = sum;
            }
        multiply(keep, P, kept, n, n, n);
        multiply(gain, R, GR, n, m, m);
        for (int i = 0; i < n * n; ++i) post[i] = Lane<T>::all(0.0);
        add_product(kept, keep, post, n, n);
        add_product(GR, gain, post, n, m);
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
        for (int i = 0; i < n; ++i) mean[i] += w * Lane<T>::load(shift, h * n + i);
    }
    for (int i = 0; i < n; ++i)
        for (int j = i; j < n; ++j) {
            T sum = miss * (0.5 * (P[i * n + j] + P[j * n + i]) + mean[i] * mean[j]);
            if (shared)
                sum += hit * Lane<T>::load(post, i * n + j);
            else
                for (int h = 0; h < k; ++h) sum += Lane<T>::load(weights, 1 + h) * Lane<T>::load(post, (h * n + i) * n + j);
            within[i * n + j] = sum;
        }
    for (int h = 0; h < k; ++h) {
        const T w = Lane<T>::load(weights, 1 + h);
        for (int i = 0; i < n; ++i) apart[i] = Lane<T>::load(shift, h * n + i) - mean[i];
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

struct Predict : shapes::Predict {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        T x[kMostStates], P[kStates2], F[kStates2], Q[kStates2], to[kMostStates], cov[kStates2];
        load(in[0], x, n), load(in[1], P, n * n), load(in[2], F, n * n), load(in[3], Q, n * n);
        predicted(x, P, F, Q, to, cov, n);
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
        T P[kStates2], F[kStates2], Q[kStates2], cov[kStates2], FP[kStates2];
        load(in[0], P, n * n), load(in[1], F, n * n), load(in[2], Q, n * n);
        multiply(F, P, FP, n, n, n);
        for (int i = 0; i < n * n; ++i) cov[i] = Q[i];
        make_symmetric(cov, n);
        add_product(FP, F, cov, n, n);
        store(out[0], cov, n * n);
    }
};

// One return that is the target's: x, P, and log N of the innovation; with F also the prediction before it.
struct Update : shapes::Update {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, m, [&](auto states, auto measured) { solve<T>(in, out, states, measured); });
    }
    template <class T, class N, class M>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n, M m) const {
        T x[kMostStates], P[kStates2], z[kMostMeasured], H[kMostMeasured * kMostStates], R[kMeasured2], nu[kMostMeasured];
        load(in[0], x, n), load(in[1], P, n * n);
        if (step) {
            T F[kStates2], Q[kStates2], to[kMostStates], cov[kStates2];
            load(in[2], F, n * n), load(in[3], Q, n * n);
            predicted(x, P, F, Q, to, cov, n);
            for (int i = 0; i < n; ++i) x[i] = to[i];
            for (int i = 0; i < n * n; ++i) P[i] = cov[i];
            in += 2;
        }
        load(in[2], z, m), load(in[3], H, m * n), load(in[4], R, m * m);
        Sight<T> sight;
        sight.take(P, H, R, n, m);
        for (int i = 0; i < m; ++i) {
            nu[i] = z[i];
            for (int j = 0; j < n; ++j) nu[i] -= H[i * n + j] * x[j];
        }
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < m; ++j) x[i] += sight.gain[i * m + j] * nu[j];
        store(out[0], x, n), store(out[1], sight.post, n * n);
        Lane<T>::store(out[2], 0, -0.5 * (sight.distance(nu, m) + sight.log_det + m * kLog2Pi));
    }
};

// in: P, z, expected, H, R, P_D; out: loglik (1+k), distance (k), log volume, shift (k, n), posterior (1|k, n, n)
struct InnovateReturns : shapes::InnovateReturns {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, m, [&](auto states, auto measured) { solve<T>(in, out, states, measured); });
    }
    template <class T, class N, class M>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n, M m) const {
        T P[kStates2], expected[kMostMeasured], H[kMostMeasured * kMostStates], R[kMeasured2], nu[kMostMeasured];
        load(in[0], P, n * n), load(in[2], expected, m), load(in[3], H, m * n);
        const T p_detect = Lane<T>::load(in[5], 0);
        Lane<T>::store(out[0], 0, safe_log(1.0 - p_detect * p_gate));
        const T log_detect = safe_log(p_detect);
        T volume = Lane<T>::all(-std::numeric_limits<double>::infinity());
        Sight<T> sight;
        for (int h = 0; h < noises; ++h) {
            for (int i = 0; i < m * m; ++i) R[i] = Lane<T>::load(in[4], h * m * m + i);
            sight.take(P, H, R, n, m);
            volume = Lane<T>::larger(volume, 0.5 * sight.log_det);
            for (int i = 0; i < n * n; ++i) Lane<T>::store(out[4], h * n * n + i, sight.post[i]);
            const T least = log_detect - 0.5 * (sight.log_det + m * kLog2Pi);
            for (int g = noises == 1 ? 0 : h; g < (noises == 1 ? k : h + 1); ++g) {
                for (int i = 0; i < m; ++i) nu[i] = Lane<T>::load(in[1], g * m + i) - expected[i];
                wrap(nu, periods);
                const T distance = sight.distance(nu, m);
                Lane<T>::store(out[1], g, distance);
                Lane<T>::store(out[0], 1 + g, least - 0.5 * distance);
                for (int i = 0; i < n; ++i) {
                    T sum = sight.gain[i * m] * nu[0];
                    for (int j = 1; j < m; ++j) sum += sight.gain[i * m + j] * nu[j];
                    Lane<T>::store(out[3], g * n + i, sum);
                }
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
