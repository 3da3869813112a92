// The textbook's IMM-PDAF on stacked modes (r, n), for one target or eight: what reference.py says in numpy.
#pragma once

#include "modes.hpp"

namespace vedette::VEDETTE_ISA {

// The sizes that banks of filters with stacked states have.
template <class F>
VEDETTE_INLINE void with_modes(int n, const F& f) {
    if (n == 4) return f(std::integral_constant<int, 4>());
    if (n == 5) return f(std::integral_constant<int, 5>());
    f(n);
}

// All modes: means relative to the first one's, covariances.
template <class T>
struct Stack {
    T origin[kMostStates], apart[kMostModes * kMostStates], P[kMostModes * kStates2];

    VEDETTE_INLINE Stack(In xs, In Ps, int n, int r) {
        load(xs, apart, r * n), load(Ps, P, r * n * n);
        for (int a = 0; a < n; ++a) origin[a] = apart[a];
        for (int j = 0; j < r; ++j)
            for (int a = 0; a < n; ++a) apart[j * n + a] -= origin[a];
    }

    // Mean, and covariance with the spread of the means, under the weights.
    template <class N>
    VEDETTE_INLINE void moments(const T* weights, T* mean, T* cov, N n, int r) const {
        stage<T>([=] { mix(weights, mean, cov, n, r); });
    }

    VEDETTE_INLINE void mix(const T* weights, T* mean, T* cov, int n, int r) const {
        T step[kMostStates], away[kMostStates];
        for (int a = 0; a < n; ++a) {
            step[a] = weights[0] * apart[a];
            for (int j = 1; j < r; ++j) step[a] += weights[j] * apart[j * n + a];
            mean[a] = origin[a] + step[a];
            for (int b = a; b < n; ++b) cov[a * n + b] = T{};
        }
        for (int j = 0; j < r; ++j) {
            for (int a = 0; a < n; ++a) away[a] = apart[j * n + a] - step[a];
            for (int a = 0; a < n; ++a)
                for (int b = a; b < n; ++b) cov[a * n + b] += weights[j] * (P[(j * n + a) * n + b] + away[a] * away[b]);
        }
        for (int a = 0; a < n; ++a)
            for (int b = a + 1; b < n; ++b) cov[b * n + a] = cov[a * n + b];
    }
};

// in: log_prob (r), log_transition (r, r), xs (r, n), Ps (r, n, n); out: log_prob (r), xs, Ps
struct ImmMix : shapes::ImmMix {
    mutable const double* read = nullptr;  // where the probabilities of switching were read last
    mutable double switching[kMostModes * kMostModes] = {};

    explicit ImmMix(const shapes::ImmMix& shape) : shapes::ImmMix(shape) {}

    template <class T>
    void run(const In* in, const Out* out) const {
        with_modes(n, [&](auto states) {
            with_coefficients<T>(states, {in[1]}, [&](auto c) { solve<T, decltype(c)>(in, out, states); });
        });
    }
    template <class C>
    VEDETTE_INLINE void read_switching(In transition, C* to) const {
        if constexpr (std::is_same_v<C, double>) {
            if (read != transition.at)
                for (int i = 0; i < r * r; ++i) switching[i] = Lane<double>::exp(transition.at[i]);
            read = transition.at;
            copy(switching, to, r * r);
        } else {
            load(transition, to, r * r);
            for (int i = 0; i < r * r; ++i) to[i] = Lane<C>::exp(to[i]);
        }
    }
    template <class T, class C, class N>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n) const {
        C from_to[kMostModes * kMostModes];
        T before[kMostModes], prob[kMostModes], after[kMostModes], weights[kMostModes * kMostModes];
        T mean[kMostModes * kMostStates], cov[kMostModes * kStates2];
        read_switching(in[1], from_to);
        load(in[0], before, r);
        T top = before[0];
        for (int i = 1; i < r; ++i) top = Lane<T>::larger(top, before[i]);
        for (int i = 0; i < r; ++i) prob[i] = Lane<T>::exp(before[i] - top);
        bool good = true;
        for (int j = 0; j < r; ++j) {
            T sum{};
            for (int i = 0; i < r; ++i) sum += weights[j * r + i] = from_to[i * r + j] * prob[i];
            good = good && all_of((sum > 1e-200) & (sum < 1e200));
            after[j] = Lane<T>::log(sum) + top;
            const T over = 1.0 / sum;
            for (int i = 0; i < r; ++i) weights[j * r + i] *= over;
        }
        if (!good) in_logarithms(before, in[1], after, weights);
        const Stack<T> stack(in[2], in[3], n, r);
        for (int j = 0; j < r; ++j) stack.moments(weights + j * r, mean + j * n, cov + j * n * n, n, r);
        store(out[0], after, r), store(out[1], mean, r * n), store(out[2], cov, r * n * n);
    }

    // The same where a mode is next to impossible, or no way leads into it: then it starts from the whole mixture.
    template <class T>
    __attribute__((noinline, cold)) void in_logarithms(const T* before, In transition, T* after, T* weights) const {
        constexpr double most = std::numeric_limits<double>::max();
        T joint[kMostModes];
        for (int j = 0; j < r; ++j) {
            for (int i = 0; i < r; ++i) joint[i] = before[i] + Lane<T>::load(transition, i * r + j);
            T* own = weights + j * r;
            after[j] = log_sum(joint, r, own);
            const auto reached = (after[j] >= -most) & (after[j] <= most);
            T total{};
            for (int i = 0; i < r; ++i) total += own[i];
            for (int i = 0; i < r; ++i) own[i] = reached ? own[i] / total : Lane<T>::exp(before[i]);
        }
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
        const Stack<T> stack(in[2], in[3], n, r);
        stack.moments(weights, mean, cov, n, r);
        store(out[0], joint, r), store(out[1], mean, n), store(out[2], cov, n * n);
        Lane<T>::store(out[3], 0, total);
    }
};

// in: xs (r, n), Ps (r, n, n), z (k, m), H, R; out: xs, Ps, loglik (r)
struct PdaUpdate : shapes::PdaUpdate {
    template <class T>
    void run(const In* in, const Out* out) const {
        with_sizes(n, m, [&](auto states, auto measured) {
            with_coefficients<T>(states, {in[3], in[4]}, [&](auto c) { solve<T, decltype(c)>(in, out, states, measured); });
        });
    }
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void solve(const In* in, const Out* out, N n, M m) const {
        C H[kMostMeasured * kMostStates], R[kMeasured2];
        T x[kMostModes * kMostStates], P[kMostModes * kStates2], z[kMostReturns * kMostMeasured];
        T expected[kMostModes * kMostMeasured], distance[kMostModes * kMostReturns], nearest[kMostReturns];
        Sight<T> sights[kMostModes];
        load(in[0], x, r * n), load(in[1], P, r * n * n), load(in[2], z, k * m), load(in[3], H, m * n), load(in[4], R, m * m);
        for (int h = 0; h < k; ++h) nearest[h] = Lane<T>::all(std::numeric_limits<double>::infinity());
        for (int j = 0; j < r; ++j) {
            T nu[kMostMeasured], *own = expected + j * m;
            sights[j].take(P + j * n * n, H, R, n, m);
            for (int i = 0; i < m; ++i) {
                own[i] = T{};
                for (int l = 0; l < n; ++l) own[i] += H[i * n + l] * x[j * n + l];
            }
            for (int h = 0; h < k; ++h) {
                for (int i = 0; i < m; ++i) nu[i] = z[h * m + i] - own[i];
                const T d = distance[j * k + h] = sights[j].distance(nu, m);
                nearest[h] = d < nearest[h] ? d : nearest[h];
            }
        }
        for (int j = 0; j < r; ++j) {
            const T loglik = weigh(sights[j].log_det, nearest, distance + j * k, m);
            Lane<T>::store(out[2], j, loglik);
            const Sight<T>* sight = sights + j;
            stage<T>([&, j] { absorb(*sight, x + j * n, P + j * n * n, H, R, z, expected + j * m, distance + j * k, n, m); });
        }
        store(out[0], x, r * n), store(out[1], P, r * n * n);
    }

    // Squared distances (k) into association weights; gives the log-likelihood of the scan.
    template <class T>
    __attribute__((noinline)) T weigh(T log_det, const T* nearest, T* distance, int m) const {
        const double miss = safe_log(1.0 - p_detect * p_gate);
        const T least = safe_log(p_detect) - log_density - 0.5 * (log_det + m * kLog2Pi);
        T top = Lane<T>::all(miss);
        for (int h = 0; h < k; ++h) {
            distance[h] = nearest[h] <= limit ? least - 0.5 * distance[h] : Lane<T>::all(-std::numeric_limits<double>::max());
            top = Lane<T>::larger(top, distance[h]);
        }
        T sum = Lane<T>::exp(miss - top);
        for (int h = 0; h < k; ++h) sum += distance[h] = Lane<T>::exp(distance[h] - top);
        const T over = 1.0 / sum;
        for (int h = 0; h < k; ++h) distance[h] *= over;
        return top + Lane<T>::log(sum);
    }

    // x and P after association: w_0 P + (1 - w_0) (I - K H) P (I - K H)' + K ((1 - w_0) R + the spread of the returns) K'.
    template <class T, class C, class N, class M>
    VEDETTE_INLINE void absorb(const Sight<T>& sight, T* x, T* P, const C* H, const C* R, const T* z, const T* expected,
                               const T* weights, N n, M m) const {
        T nu[kMostMeasured], mean[kMostMeasured], noise[kMeasured2], step[kMostStates], post[kStates2], hit{};
        for (int i = 0; i < m; ++i) mean[i] = T{};
        for (int h = 0; h < k; ++h) {
            hit += weights[h];
            for (int i = 0; i < m; ++i) mean[i] += weights[h] * (z[h * m + i] - expected[i]);
        }
        const T miss = 1.0 - hit, over = hit > 0.0 ? 1.0 / hit : T{};
        for (int i = 0; i < m; ++i)
            for (int l = i; l < m; ++l) noise[i * m + l] = miss * mean[i] * mean[l];
        for (int h = 0; h < k; ++h) {
            for (int i = 0; i < m; ++i) nu[i] = z[h * m + i] - expected[i] - mean[i];
            for (int i = 0; i < m; ++i)
                for (int l = i; l < m; ++l) noise[i * m + l] += weights[h] * nu[i] * nu[l];
        }
        for (int i = 0; i < m; ++i)
            for (int l = i; l < m; ++l) noise[i * m + l] = noise[l * m + i] = R[i * m + l] + noise[i * m + l] * over;
        sight.shift(mean, step, n, m);
        sight.joseph(P, H, noise, post, n, m);
        for (int i = 0; i < n; ++i) {
            x[i] += step[i];
            for (int l = i; l < n; ++l) P[i * n + l] = P[l * n + i] = miss * P[i * n + l] + hit * post[i * n + l];
        }
    }
};

}  // namespace vedette::VEDETTE_ISA
