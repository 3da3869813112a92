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
        const T none = Lane<T>::all(std::numeric_limits<double>::quiet_NaN());
        for (int i = 0; i < n; ++i) {
            const T variance = P[i * n + i];
            const auto free = variance > 0.0;
            over[i] = free ? 1.0 / Lane<T>::sqrt(free ? variance : Lane<T>::all(1.0)) : Lane<T>::all(1.0);
            white[i] = variance >= 0.0 ? (free ? white[i] * over[i] : T{}) : none;
        }
        for (int j = 0; j < n; ++j) {  // L L' is the correlation
            T pivot = Lane<T>::all(1.0);
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

// in: P; out: offsets (2n+1, n) from the mean
struct SigmaPoints : shapes::SigmaPoints {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, [&](auto states) { solve<T>(in, out, states); });
    }
    template <class T, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        const Square<T> P(in[0], n, kSymmetric);
        T turned[kStates2], nothing[kMostStates];  // turned: L'
        for (int i = 0; i < n * n; ++i) turned[i] = T{};
        for (int i = 0; i < n; ++i) nothing[i] = T{};
        for (int j = 0; j < n; ++j) {
            const T variance = scale * P[j * n + j];
            T pivot = variance;
            for (int l = 0; l < j; ++l) pivot -= turned[l * n + j] * turned[l * n + j];
            const auto free = pivot > 1e-14 * variance;  // else the axis is known exactly, and has no variance
            const T root = Lane<T>::sqrt(free ? pivot : Lane<T>::all(1.0)), over = free ? 1.0 / root : T{};
            turned[j * n + j] = free ? root : T{};
            for (int i = j + 1; i < n; ++i) {
                T sum = scale * P[j * n + i];
                for (int l = 0; l < j; ++l) sum -= turned[l * n + i] * turned[l * n + j];
                turned[j * n + i] = sum * over;
            }
        }
        store(out[0], nothing, n), store(part(out[0], n), turned, n * n);
        for (int i = 0; i < n * n; ++i) turned[i] = -turned[i];
        store(part(out[0], n + n * n), turned, n * n);
    }
};

// in: dx (s, n), dz (s, m), weights (s), nu (k, m), R (1|k, m, m)
// out: loglik (k), distance (k), log volume (1|k), shift (k, n), posterior (1|k, n, n)
struct InnovatePoints : shapes::InnovatePoints {
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
            const Square<T> R(part(in[4], h * m * m), m, kSymmetric);
            T S[kMeasured2], post[kStates2], nu[kMostMeasured];
            Sight<T> sight;
            for (int i = 0; i < m; ++i)
                for (int j = i; j < m; ++j) set_entry(S, i, j, m, T(spread[i * m + j] + R[i * m + j]));
            sight.log_det = invert(S, sight.inverse, m, sight.sound);
            if (m == 1) sight.sound = S[0] > 0.0;
            if (m == 2) sight.sound = S[0] * S[3] - S[1] * S[1] > kSingular * S[0] * S[3];
            multiply<kLeft>(sight.inverse, cross, sight.gain, m, m, n);
            narrow<T>(dx, dz, weights, R, sight.gain, post, n, m);
            if (!all_of(sight.sound)) take_root<T>(sight, dx, dz, weights, R, post);
            store_symmetric(part(out[4], h * n * n), post, n);
            Lane<T>::store(out[2], h, 0.5 * sight.log_det);
            const T least = -0.5 * (sight.log_det + m * kLog2Pi);
            for (int g = noises == 1 ? 0 : h; g < (noises == 1 ? k : h + 1); ++g) {
                load(part(in[3], g * m), nu, m);
                sight.judge(nu, least, part(out[0], g), part(out[1], g), part(out[3], g * n), n, m);
            }
        }
    }

    // Those problems whose S is next to singular, by roots.
    template <class T>
    __attribute__((noinline, cold)) void take_root(Sight<T>& sight, const T* dx, const T* dz, const T* weights, const T* R,
                                                   T* post) const {
        for (int l = 0; l < Lane<T>::count; ++l) {
            if (is_set(sight.sound, l)) continue;
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
            sight.take_lane(update, post, n, m, l);
        }
    }

    // The posterior covariance: the points' own after the gain K, and K R K'.
    template <class T>
    VEDETTE_INLINE void narrow(const T* dx, const T* dz, const T* weights, const T* R, const T* gain, T* post, int n,
                               int m) const {
        T left[kMostStates], noisy[kMostMeasured * kMostStates];
        multiply<kLeft>(R, gain, noisy, m, m, n);
        for (int i = 0; i < n * n; ++i) post[i] = T{};
        add_turned_product(post, gain, noisy, post, n, m);
        for (int p = 0; p < s; ++p) {
            for (int i = 0; i < n; ++i) {
                left[i] = dx[p * n + i];
                for (int l = 0; l < m; ++l) left[i] -= dz[p * m + l] * gain[l * n + i];
            }
            for (int i = 0; i < n; ++i) {
                const T scaled = weights[p] * left[i];
                for (int j = i; j < n; ++j) post[i * n + j] += scaled * left[j];
            }
        }
        if constexpr (std::is_same_v<T, double>) mirror(post, n);
    }
};

}  // namespace vedette::VEDETTE_ISA
