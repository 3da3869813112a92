// One scan's association within a mode: probabilistic data association with 0..k returns, in the linear domain.
#pragma once
#include "filter.hpp"

constexpr int most_returns = 64;

// Likelihood of the scan against clutter, and the belief after it. `d` holds the returns' squared distances, `inside` 1 or 0.
template <class V>
inline Belief<V> associated(const Belief<V>& b, const Look<V>& seen, const V (*z)[m], const V* d, const V* inside, int k,
                            const Clutter& clutter, V& likelihood) {
    V scale = clutter.detect / (clutter.density * 6.283185307179586) * root(seen.over_det);
    V total = V{} + clutter.missed, first{}, second{}, a{}, c{}, e{};
    for (int i = 0; i < k; i++) {
        V weight = scale * inside[i] * exponential(-0.5 * d[i]);
        V u = z[i][0] - seen.z[0], v = z[i][1] - seen.z[1];
        V wu = weight * u, wv = weight * v;
        total += weight, first += wu, second += wv;
        a += wu * u, c += wv * u, e += wv * v;
    }
    V over = 1.0 / total;
    V claimed = 1.0 - clutter.missed * over;
    first *= over, second *= over;
    V A[3] = {claimed * seen.S[0] - (a * over - first * first), claimed * seen.S[1] - (c * over - first * second),
              claimed * seen.S[2] - (e * over - second * second)};
    V KA[n][m];
    for (int j = 0; j < n; j++)
        for (int i = 0; i < m; i++) KA[j][i] = seen.gain[j][0] * A[at(0, i)] + seen.gain[j][1] * A[at(1, i)];
    likelihood = total;
    return absorbed(b, seen, first, second, KA);
}
