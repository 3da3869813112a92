// Hypotheses side by side, of one cluster and of all, and which of them are kept.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "arguments.hpp"

namespace vedette {

// Hypotheses side by side: the weight of each, and where in `leaves` its own begin.
struct Held {
    std::vector<double> weights;
    std::vector<npy_int64> starts{0}, leaves;

    std::size_t size() const { return weights.size(); }
    const npy_int64* begin(std::size_t i) const { return leaves.data() + starts[i]; }
    const npy_int64* end(std::size_t i) const { return leaves.data() + starts[i + 1]; }
    npy_intp count(std::size_t i) const { return static_cast<npy_intp>(starts[i + 1] - starts[i]); }

    void clear() { weights.clear(), starts.assign(1, 0), leaves.clear(); }
    void close(double weight) { weights.push_back(weight), starts.push_back(static_cast<npy_int64>(leaves.size())); }
    void append(const npy_int64* from, const npy_int64* to) { leaves.insert(leaves.end(), from, to); }
};

// The hypotheses of all clusters, as they are given or returned.
struct Flat {
    Held held;
    std::vector<npy_int64> cluster;
    std::vector<double> lost;
    npy_int64 clusters = 0;

    void add(const Held& some, double lost_here) {
        for (std::size_t i = 0; i < some.size(); ++i) {
            cluster.push_back(clusters);
            held.append(some.begin(i), some.end(i));
            held.close(some.weights[i]);
        }
        lost.push_back(lost_here);
        ++clusters;
    }
};

// The rows of the `most` heaviest, of those above `least`, and of the heaviest.
inline std::vector<std::size_t> heaviest(const std::vector<double>& weights, npy_int64 most, double least) {
    std::vector<std::size_t> rows(weights.size());
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    const auto before = [&](std::size_t a, std::size_t b) { return weights[a] != weights[b] ? weights[a] > weights[b] : a < b; };
    if (static_cast<npy_int64>(rows.size()) > most) {
        std::partial_sort(rows.begin(), rows.begin() + most, rows.end(), before);
        rows.resize(static_cast<std::size_t>(most));
    } else {
        std::sort(rows.begin(), rows.end(), before);
    }
    const double above = std::min(least, 0.5 * weights[rows[0]]);
    while (!(weights[rows.back()] > above)) rows.pop_back();
    return rows;
}

// Hypotheses without repetitions, heaviest first.
inline void drop_repetitions(Held& held) {
    std::size_t size = 4;
    while (size < 2 * held.size()) size *= 2;
    std::vector<std::ptrdiff_t> table(size, -1);
    std::vector<std::size_t> rows;
    std::vector<double> total;
    for (std::size_t i = 0; i < held.size(); ++i) {
        std::uint64_t hash = 0x9E3779B97F4A7C15u;
        for (const npy_int64* leaf = held.begin(i); leaf < held.end(i); ++leaf)
            hash = (hash ^ static_cast<std::uint64_t>(*leaf)) * 0xBF58476D1CE4E5B9u, hash ^= hash >> 31;
        std::size_t at = hash & (size - 1);
        while (table[at] >= 0 && !std::equal(held.begin(i), held.end(i), held.begin(rows[table[at]]), held.end(rows[table[at]])))
            at = (at + 1) & (size - 1);
        if (table[at] < 0) {
            table[at] = static_cast<std::ptrdiff_t>(rows.size());
            rows.push_back(i), total.push_back(held.weights[i]);
        } else {
            total[table[at]] += held.weights[i];
        }
    }
    if (rows.size() == held.size()) return;
    std::vector<std::size_t> order(rows.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return total[a] > total[b]; });
    Held merged;
    for (std::size_t one : order) {
        merged.append(held.begin(rows[one]), held.end(rows[one]));
        merged.close(total[one]);
    }
    std::swap(held, merged);
}

}  // namespace vedette
