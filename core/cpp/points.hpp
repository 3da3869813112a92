// The kernels that take roots of covariances, for one problem or eight: what reference.py says in numpy. s points.
#pragma once

#include "filters.hpp"

namespace vedette::VEDETTE_ISA {

// in: vector (n), covariance; out: L^-1 vector, NaN where the covariance is not positive definite
struct Whiten : shapes::Whiten {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        const Square<T> P(in[1], n, kSymmetric);
        T white[kMostStates], L[kStates2], over[kMostStates], inverse[kMostStates];
        load(in[0], white, n);
        const T none = Lane<T>::broadcast(std::numeric_limits<double>::quiet_NaN());
        for (int i = 0; i < n; ++i) {
            const T variance = P[i * n + i];
            const auto free = variance > 0.0;
            over[i] = free ? 1.0 / Lane<T>::sqrt(free ? variance : Lane<T>::broadcast(1.0)) : Lane<T>::broadcast(1.0);
            white[i] = variance >= 0.0 ? (free ? white[i] * over[i] : T{}) : none;
        }
        for (int j = 0; j < n; ++j) {  // L L' is the correlation
            T pivot = Lane<T>::broadcast(1.0);
            for (int l = 0; l < j; ++l) pivot -= L[j * n + l] * L[j * n + l];
            inverse[j] = 1.0 / Lane<T>::sqrt(pivot > 0.0 ? pivot : none);
            for (int i = j + 1; i < n; ++i) {
                T sum = P[j * n + i] * over[i] * over[j];
                for (int l = 0; l < j; ++l) sum -= L[i * n + l] * L[j * n + l];
                L[i * n + j] = sum * inverse[j];
            }
        }
        for (int j = 0; j < n; ++j) {
            for (int l = 0; l < j; ++l) white[j] -= L[j * n + l] * white[l];
            white[j] *= inverse[j];
        }
        store(out[0], white, n);
    }
};

// in: x, P, F, Q, later mean (n) and covariance; out: x, P
struct SmoothLinear : shapes::SmoothLinear {
    static constexpr bool kOneByOne = true;

    void run(const In* in, const Out* out) const {
        with_sizes(n, [&](auto states) { solve(in, out, states); });
    }
    template <class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        const double *x = in[0].at, *P = in[1].at, *F = in[2].at, *Q = in[3].at, *later = in[4].at;
        double ahead[kMostStates], cov[kStates2], turned[kStates2];  // turned: F P
        apply(F, x, ahead, n, n);
        congruence(F, P, Q, turned, cov, n, n);
        // The root L of [cov; turned'], turned: row j is its column j, whose first part is L11.
        double root[kMostStates][2 * kMostStates], over[kMostStates];
        const double least = 16 * n * std::numeric_limits<double>::epsilon();
        for (int j = 0; j < n; ++j) {
            for (int i = j; i < 2 * n; ++i) root[j][i] = i < n ? cov[j * n + i] : turned[j * n + i - n];
            const double variance = root[j][j];
            for (int l = 0; l < j; ++l)
                for (int i = j; i < 2 * n; ++i) root[j][i] -= root[l][i] * root[l][j];
            const double pivot = root[j][j];
            over[j] = pivot > least * variance ? 1.0 / std::sqrt(pivot) : 0.0;
            for (int i = j; i < 2 * n; ++i) root[j][i] *= over[j];
        }
        double gain[kStates2], left[kStates2], within[kStates2], known[kStates2], smoothed[kStates2], step[kMostStates];
        for (int r = 0; r < n; ++r)
            for (int j = n - 1; j >= 0; --j) {  // gain L11 = L21
                double sum = root[j][n + r];
                for (int l = j + 1; l < n; ++l) sum -= gain[r * n + l] * root[j][l];
                gain[r * n + j] = sum * over[j];
            }
        multiply(gain, F, left, n, n, n);
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) left[i * n + j] = (i == j ? 1.0 : 0.0) - left[i * n + j];
        for (int i = 0; i < n * n; ++i) smoothed[i] = 0.0, known[i] = Q[i] + in[5].at[i];
        congruence(left, P, smoothed, turned, within, n, n);
        for (int i = 0; i < n; ++i) step[i] = later[i] - ahead[i];
        wrap(step, periods);
        apply(gain, step, ahead, n, n);
        for (int i = 0; i < n; ++i) ahead[i] += x[i];
        wrap(ahead, periods);
        congruence(gain, known, within, turned, smoothed, n, n);
        store(out[0], ahead, n), store_symmetric(out[1], smoothed, n);
    }
};

// in: P; out: offsets (2n+1, n) from the mean
struct SigmaPoints : shapes::SigmaPoints {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        const Square<T> P(in[0], n, kSymmetric);
        T transposed[kStates2], nothing[kMostStates];  // turned: L'
        for (int i = 0; i < n * n; ++i) transposed[i] = T{};
        for (int i = 0; i < n; ++i) nothing[i] = T{};
        for (int j = 0; j < n; ++j) {
            const T variance = scale * P[j * n + j];
            T pivot = variance;
            for (int l = 0; l < j; ++l) pivot -= transposed[l * n + j] * transposed[l * n + j];
            const auto free = pivot > 1e-14 * variance;  // else the axis is known exactly, and has no variance
            const T root = Lane<T>::sqrt(free ? pivot : Lane<T>::broadcast(1.0)), over = free ? 1.0 / root : T{};
            transposed[j * n + j] = free ? root : T{};
            for (int i = j + 1; i < n; ++i) {
                T sum = scale * P[j * n + i];
                for (int l = 0; l < j; ++l) sum -= transposed[l * n + i] * transposed[l * n + j];
                transposed[j * n + i] = sum * over;
            }
        }
        store(out[0], nothing, n), store(at_offset(out[0], n), transposed, n * n);
        for (int i = 0; i < n * n; ++i) transposed[i] = -transposed[i];
        store(at_offset(out[0], n + n * n), transposed, n * n);
    }
};

// in: dx (s, n), dz (s, m), weights (s), nu (k, m), R (1|k, m, m)
// out: loglik (k), distance (k), log volume (1|k), shift (k, n), posterior (1|k, n, n)
struct EvaluatePoints : shapes::EvaluatePoints {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, m, [&](auto states, auto measured) { solve<T>(in, out, states, measured); });
    }
    template <class T, class N, class M>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n, M m) const {
        const Matrix<T, kMostPoints * kMostStates> dx(in[0], s * n);
        const Matrix<T, kMostPoints * kMostMeasured> dz(in[1], s * m);
        const Matrix<T, kMostPoints> weights(in[2], s);
        T cross[kMostMeasured * kMostStates], spread[kMeasured2];
        for (int i = 0; i < m * n; ++i) cross[i] = T{};
        for (int i = 0; i < m * m; ++i) spread[i] = T{};
        for (int p = 0; p < s; ++p)
            for (int i = 0; i < m; ++i) {
                const T scaled = weights[p] * dz[p * m + i];
                for (int j = 0; j < n; ++j) cross[i * n + j] += scaled * dx[p * n + j];
                for (int j = i; j < m; ++j) spread[i * m + j] += scaled * dz[p * m + j];
            }
        for (int h = 0; h < noises; ++h) {
            const Square<T> R(at_offset(in[4], h * m * m), m, kSymmetric);
            T S[kMeasured2], post[kStates2], nu[kMostMeasured];
            Correction<T> correction;
            for (int i = 0; i < m; ++i)
                for (int j = i; j < m; ++j) set_entry(S, i, j, m, T(spread[i * m + j] + R[i * m + j]));
            Mask<T> is_independent;
            correction.log_det = invert(S, correction.inverse, m, correction.is_regular, is_independent);
            if (m == 1) correction.is_regular = S[0] > 0.0;
            if (m == 2) correction.is_regular = S[0] * S[3] - S[1] * S[1] > kSingular * S[0] * S[3];
            multiply<kLeft>(correction.inverse, cross, correction.gain, m, m, n);
            posterior_covariance<T>(dx, dz, weights, R, correction.gain, post, n, m);
            if (!all_of(correction.is_regular)) recompute_by_square_root<T>(correction, dx, dz, weights, R, post);
            store_symmetric(at_offset(out[4], h * n * n), post, n);
            Lane<T>::store(out[2], h, 0.5 * correction.log_det);
            const T least = -0.5 * (correction.log_det + m * kLog2Pi);
            for (int g = noises == 1 ? 0 : h; g < (noises == 1 ? k : h + 1); ++g) {
                load(at_offset(in[3], g * m), nu, m);
                correction.score_residual(nu, least, at_offset(out[0], g), at_offset(out[1], g), at_offset(out[3], g * n), n, m);
            }
        }
    }

    // Those problems whose S is next to singular, by roots.
    template <class T>
    __attribute__((noinline, cold)) void recompute_by_square_root(Correction<T>& correction, const T* dx, const T* dz,
                                                                  const T* weights, const T* R, T* post) const {
        for (int l = 0; l < Lane<T>::count; ++l) {
            if (is_set(correction.is_regular, l)) continue;
            SquareRootUpdate update;
            double noise[kMeasured2];
            for (int i = 0; i < m; ++i)
                for (int j = i; j < m; ++j) noise[i * m + j] = lane(R[i * m + j], l);
            for (int p = 0; p < s; ++p) {
                const double scale = std::sqrt(lane(weights[p], l));
                for (int i = 0; i < m; ++i) update.A[m + p][i] = scale * lane(dz[p * m + i], l);
                for (int j = 0; j < n; ++j) update.A[m + p][m + j] = scale * lane(dx[p * n + j], l);
            }
            update.solve(noise, s, n, m);
            correction.set_problem(update, post, n, m, l);
        }
    }

    // The posterior covariance: the points' own after the gain K, and K R K'.
    template <class T, class N, class M>
    VEDETTE_INLINE void posterior_covariance(const T* dx, const T* dz, const T* weights, const T* R, const T* gain, T* post,
                                             N n, M m) const {
        T left[kMostStates], noisy[kMostMeasured * kMostStates];
        multiply<kLeft>(R, gain, noisy, m, m, n);
        for (int i = 0; i < n * n; ++i) post[i] = T{};
        add_transposed_product(post, gain, noisy, post, n, m);
        for (int p = 0; p < s; ++p) {
            for (int i = 0; i < n; ++i) {
                left[i] = dx[p * n + i];
                for (int l = 0; l < m; ++l) left[i] -= dz[p * m + l] * gain[l * n + i];
            }
            asm("" : "+m"(left));  // one rounding for all its uses: else some get a fused one, and the sum is not PSD
            for (int i = 0; i < n; ++i) {
                const T scaled = weights[p] * left[i];
                for (int j = i; j < n; ++j) post[i * n + j] += scaled * left[j];
            }
        }
        if constexpr (std::is_same_v<T, double>) copy_upper_to_lower(post, n);
    }
};

}  // namespace vedette::VEDETTE_ISA
