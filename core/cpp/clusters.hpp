// Hypotheses of clusters: how those of a cluster grow by a scan, and what of them is left when leaves end. As `clusters.py`.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>

#include "hypotheses.hpp"

namespace vedette {

constexpr double kMostOperations = 4096;  // as `MOST_OPERATIONS` of the reference

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

class Growth {
  public:
    Growth(const npy_int64* ends, const npy_int64* returns, const double* scores, const double* miss, npy_intp l,
           const npy_bool* begins, npy_intp k, npy_int64 most, double least)
        : ends_(ends), returns_(returns), scores_(scores), miss_(miss, miss + l), begins_(begins), l_(l), k_(k), most_(most),
          least_(least), touched_(static_cast<std::size_t>(k), 0), place_(static_cast<std::size_t>(k), -1) {
        for (npy_intp i = 0; i < l; ++i) {
            double top = first(i) < ends_[i] ? miss_[i] : 0.0;
            for (npy_int64 p = first(i); p < ends_[i]; ++p) top = std::max(top, scores_[p]);
            miss_[i] = std::max(miss_[i], top - entries::kFarthest);
        }
    }

    Flat out;

    void run(const npy_int64* cluster, const double* weights, const npy_int64* starts, const npy_int64* leaves, npy_intp h) {
        const npy_intp clusters = h > 0 ? static_cast<npy_intp>(cluster[h - 1]) + 1 : 0;
        std::vector<npy_intp> hypotheses(static_cast<std::size_t>(clusters) + 1, 0), group(static_cast<std::size_t>(clusters)),
            user(static_cast<std::size_t>(k_), -1);
        for (npy_intp i = 0; i < h; ++i) hypotheses[cluster[i] + 1] = i + 1;
        std::iota(group.begin(), group.end(), npy_intp{0});
        const auto root = [&group](npy_intp i) {
            while (group[i] != i) i = group[i] = group[group[i]];
            return i;
        };
        for (npy_intp i = 0; i < h; ++i)
            for (npy_int64 at = starts[i]; at < starts[i + 1]; ++at)
                for (npy_int64 p = first(leaves[at]); p < ends_[leaves[at]]; ++p) {
                    npy_intp& other = user[returns_[p]];
                    const npy_intp a = root(static_cast<npy_intp>(cluster[i])), b = other < 0 ? a : root(other);
                    group[std::max(a, b)] = std::min(a, b), other = a;
                }
        std::vector<std::vector<npy_intp>> members(static_cast<std::size_t>(clusters));
        for (npy_intp c = 0; c < clusters; ++c) members[root(c)].push_back(c);
        for (const std::vector<npy_intp>& own : members) {
            if (own.empty()) continue;
            double kept = 1.0;
            before_.clear();
            take(own[0], hypotheses, weights, starts, leaves, before_);
            for (std::size_t i = 1; i < own.size(); ++i) {
                other_.clear();
                take(own[i], hypotheses, weights, starts, leaves, other_);
                kept *= multiply();
            }
            if (own.size() > 1)
                for (std::size_t i = 0; i < before_.size(); ++i)
                    std::sort(before_.leaves.begin() + before_.starts[i], before_.leaves.begin() + before_.starts[i + 1]);
            kept *= associate();
            begin();
            out.add(after_, 1.0 - kept);
        }
        for (npy_intp j = 0; j < k_; ++j) {
            if (!begins_[j] || touched_[j]) continue;
            after_.clear();
            after_.leaves.push_back(l_ * (1 + k_) + 1 + j);
            after_.close(1.0);
            out.add(after_, 0.0);
        }
    }

  private:
    const npy_int64 *ends_, *returns_;
    const double* scores_;
    std::vector<double> miss_;
    const npy_bool* begins_;
    npy_intp l_, k_;
    npy_int64 most_;
    double least_;
    std::vector<char> touched_;
    std::vector<int> place_;
    Held before_, other_, product_, after_;
    Ranking ranking_;
    std::vector<npy_int64> used_, own_;
    std::vector<npy_intp> open_;
    std::vector<double> cost_, logs_, sums_, after_sums_;
    std::vector<std::pair<double, npy_int64>> single_;

    npy_int64 first(npy_int64 leaf) const { return leaf > 0 ? ends_[leaf - 1] : 0; }

    static void take(npy_intp c, const std::vector<npy_intp>& hypotheses, const double* weights, const npy_int64* starts,
                     const npy_int64* leaves, Held& held) {
        for (npy_intp i = hypotheses[c]; i < hypotheses[c + 1]; ++i) {
            held.append(leaves + starts[i], leaves + starts[i + 1]);
            held.close(weights[i]);
        }
    }

    // Multiplies the hypotheses before the scan by others; returns the share of all weight that the heaviest products have.
    double multiply() {
        std::vector<double> each;
        each.reserve(before_.size() * other_.size());
        for (double w : before_.weights)
            for (double v : other_.weights) each.push_back(w * v);
        const std::vector<std::size_t> rows = heaviest(each, most_, least_);
        double kept = 0.0;
        for (std::size_t row : rows) kept += each[row];
        product_.clear();
        for (std::size_t row : rows) {
            const std::size_t i = row / other_.size(), j = row % other_.size();
            product_.append(before_.begin(i), before_.end(i));
            product_.append(other_.begin(j), other_.end(j));
            product_.close(each[row] / kept);
        }
        std::swap(before_, product_);
        return kept;
    }

    // The best associations of each hypothesis, and of these the heaviest; returns the share of all weight that they have.
    double associate() {
        Held found;
        std::vector<double> totals;
        logs_.clear(), own_.clear();
        for (std::size_t i = 0; i < before_.size(); ++i) {
            const double log_weight = std::log(before_.weights[i]);
            const std::size_t already = logs_.size();
            const bool all = share_out(i, found);
            double top = -std::numeric_limits<double>::infinity(), sum = 0.0;
            for (std::size_t j = already; j < logs_.size(); ++j) top = std::max(top, logs_[j]);
            for (std::size_t j = already; j < logs_.size(); ++j) sum += std::exp(logs_[j] - top);
            double every = top + std::log(sum);
            if (!all) every = std::max(every, log_total(i));
            totals.push_back(log_weight + every);
            for (std::size_t j = already; j < logs_.size(); ++j) logs_[j] += log_weight;
        }
        const double top = *std::max_element(logs_.begin(), logs_.end());
        double whole = 0.0, sum = 0.0, kept = 0.0;
        for (double one : totals) whole += std::exp(one - top);
        for (double& one : logs_) sum += one = std::exp(one - top);
        for (double& one : logs_) one /= sum;
        after_.clear();
        const std::vector<std::size_t> rows = heaviest(logs_, most_, least_);
        for (std::size_t row : rows) kept += logs_[row];
        for (std::size_t row : rows) {
            after_.append(found.begin(row), found.end(row));
            after_.close(logs_[row] / kept);
        }
        return std::min(kept * sum / whole, 1.0);
    }

    // Appends the best associations of one hypothesis to `found`, and their log scores; returns whether they are all there are.
    bool share_out(std::size_t i, Held& found) {
        const npy_int64* leaf = before_.begin(i);
        const npy_intp t = before_.count(i), columns = 1 + k_;
        const auto wanted = static_cast<npy_int64>(std::ceil(static_cast<double>(most_) * before_.weights[i]));
        double rest = 0.0;
        open_.clear(), used_.clear();
        for (npy_intp a = 0; a < t; ++a) {
            if (first(leaf[a]) == ends_[leaf[a]]) {
                rest += miss_[leaf[a]];
                continue;
            }
            open_.push_back(a);
            for (npy_int64 p = first(leaf[a]); p < ends_[leaf[a]]; ++p) {
                if (place_[returns_[p]] < 0) place_[returns_[p]] = 0, used_.push_back(returns_[p]);
                if (!touched_[returns_[p]]) touched_[returns_[p]] = 1;
            }
        }
        std::sort(used_.begin(), used_.end());
        own_.insert(own_.end(), used_.begin(), used_.end());
        const int n = static_cast<int>(open_.size()), k = static_cast<int>(used_.size());
        const auto add = [&](double score) {
            const std::size_t at = found.leaves.size();
            for (npy_intp a = 0; a < t; ++a) found.leaves.push_back(leaf[a] * columns);
            found.close(0.0);
            logs_.push_back(score);
            return at;
        };
        bool all;
        if (n == 0) {
            add(rest);
            all = true;
        } else if (n == 1) {
            const npy_int64 only = leaf[open_[0]];
            single_.clear();
            for (npy_int64 p = first(only); p < ends_[only]; ++p) single_.emplace_back(-scores_[p], 1 + returns_[p]);
            single_.emplace_back(-miss_[only], columns);
            std::sort(single_.begin(), single_.end());
            all = static_cast<npy_int64>(single_.size()) < wanted;
            if (static_cast<npy_int64>(single_.size()) > wanted) single_.resize(static_cast<std::size_t>(wanted));
            for (const auto& [cost, choice] : single_) found.leaves[add(rest - cost) + open_[0]] += choice < columns ? choice : 0;
        } else {
            for (int j = 0; j < k; ++j) place_[used_[j]] = j;
            const int width = k + n;
            cost_.assign(static_cast<std::size_t>(n) * width, std::numeric_limits<double>::infinity());
            for (int a = 0; a < n; ++a) {
                const npy_int64 own = leaf[open_[a]];
                double* row = cost_.data() + static_cast<std::ptrdiff_t>(a) * width;
                for (npy_int64 p = first(own); p < ends_[own]; ++p) row[place_[returns_[p]]] = -scores_[p];
                row[k + a] = -miss_[own];
            }
            ranking_.take(cost_.data(), n, width);
            ranking_.find(wanted);
            all = static_cast<npy_int64>(ranking_.found.size()) < wanted;
            for (const auto& [cost, node] : ranking_.found) {
                const std::size_t at = add(rest - cost);
                for (int a = 0; a < n; ++a) {
                    const int column = ranking_.columns(node)[a];
                    if (column < k) found.leaves[at + static_cast<std::size_t>(open_[a])] += 1 + used_[column];
                }
            }
        }
        for (npy_int64 j : used_) place_[j] = -1;
        return all;
    }

    // Log of the sum over all joint associations of a hypothesis, or a bound of it where that takes long.
    double log_total(std::size_t i) {
        used_.clear();
        for (const npy_int64* leaf = before_.begin(i); leaf < before_.end(i); ++leaf)
            for (npy_int64 p = first(*leaf); p < ends_[*leaf]; ++p)
                if (++place_[returns_[p]] == 0) used_.push_back(returns_[p]);
        int shared = 0;
        double pairs = 0.0;
        for (npy_int64 j : used_) {
            pairs += place_[j] > 0 ? 1 + place_[j] : 0;
            place_[j] = place_[j] > 0 ? shared++ : -1;
        }
        const bool summed = shared <= 30 && pairs * std::ldexp(1.0, shared) <= kMostOperations;
        sums_.assign(summed ? std::size_t{1} << shared : 1, 0.0);
        sums_[0] = 1.0;
        double log_total = 0.0;
        for (const npy_int64* leaf = before_.begin(i); leaf < before_.end(i); ++leaf) {
            if (first(*leaf) == ends_[*leaf]) {
                log_total += miss_[*leaf];
                continue;
            }
            double top = miss_[*leaf];
            for (npy_int64 p = first(*leaf); p < ends_[*leaf]; ++p) top = std::max(top, scores_[p]);
            double stay = std::exp(miss_[*leaf] - top);
            for (npy_int64 p = first(*leaf); p < ends_[*leaf]; ++p)
                if (!summed || place_[returns_[p]] < 0) stay += std::exp(scores_[p] - top);
            log_total += top;
            if (sums_.size() == 1) {
                log_total += std::log(stay);
                continue;
            }
            after_sums_ = sums_;
            for (double& one : after_sums_) one *= stay;
            for (npy_int64 p = first(*leaf); p < ends_[*leaf]; ++p) {
                if (place_[returns_[p]] < 0) continue;
                const std::size_t bit = std::size_t{1} << place_[returns_[p]];
                const double weight = std::exp(scores_[p] - top);
                for (std::size_t base = 0; base < sums_.size(); base += 2 * bit)
                    for (std::size_t s = base; s < base + bit; ++s) after_sums_[s + bit] += weight * sums_[s];
            }
            sums_.swap(after_sums_);
        }
        for (npy_int64 j : used_) place_[j] = -1;
        return log_total + std::log(std::accumulate(sums_.begin(), sums_.end(), 0.0));
    }

    // Adds the tracks that begin at returns which a hypothesis leaves free.
    void begin() {
        std::sort(own_.begin(), own_.end());
        own_.erase(std::unique(own_.begin(), own_.end()), own_.end());
        const npy_intp columns = 1 + k_;
        product_.clear();
        for (std::size_t i = 0; i < after_.size(); ++i) {
            for (const npy_int64* code = after_.begin(i); code < after_.end(i); ++code)
                if (*code % columns) place_[*code % columns - 1] = 0;
            product_.append(after_.begin(i), after_.end(i));
            for (npy_int64 j : own_)
                if (begins_[j] && place_[j] < 0) product_.leaves.push_back(l_ * columns + 1 + j);
            for (const npy_int64* code = after_.begin(i); code < after_.end(i); ++code)
                if (*code % columns) place_[*code % columns - 1] = -1;
            product_.close(after_.weights[i]);
        }
        std::swap(after_, product_);
    }
};

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

// A cluster's hypotheses as a table: which of its leaves, or none, each track has in each.
class Factors {
  public:
    // `number` (l,): -1 for each leaf, and so it is left.
    Factors(const Held& held, const npy_int64* track, double tolerance, std::vector<int>& number)
        : held_(held), tolerance_(tolerance) {
        const std::size_t h = held.size();
        std::vector<npy_int64> tracks;
        for (std::size_t i = 0; i < h; ++i)
            for (const npy_int64* leaf = held.begin(i); leaf < held.end(i); ++leaf)
                if (number[*leaf] < 0) number[*leaf] = 0, tracks.push_back(*leaf);
        for (npy_int64& leaf : tracks) number[leaf] = -1, leaf = track[leaf];
        std::sort(tracks.begin(), tracks.end());
        tracks.erase(std::unique(tracks.begin(), tracks.end()), tracks.end());
        const std::size_t t = tracks.size();
        leaf_.assign(t * h, -1), which_.assign(t * h, -1), count_.assign(t, 0), share_.resize(t);
        for (std::size_t i = 0; i < h; ++i) {
            std::size_t a = 0;  // leaves ascend as their tracks do
            for (const npy_int64* leaf = held.begin(i); leaf < held.end(i); ++leaf, ++a) {
                while (tracks[a] != track[*leaf]) ++a;
                leaf_[a * h + i] = *leaf;
            }
        }
        for (std::size_t a = 0; a < t; ++a) {
            int none = -1;
            for (std::size_t i = 0; i < h; ++i) {
                const npy_int64 leaf = leaf_[a * h + i];
                int& own = leaf < 0 ? none : number[leaf];
                if (own < 0) own = static_cast<int>(share_[a].size()), share_[a].push_back(0.0);
                which_[a * h + i] = own;
                share_[a][own] += held.weights[i];
            }
            for (std::size_t i = 0; i < h; ++i)
                if (leaf_[a * h + i] >= 0) number[leaf_[a * h + i]] = -1;
            count_[a] = share_[a].size();
        }
        size_ = t;
    }

    void split(Flat& out) const {
        const std::size_t t = size_;
        std::vector<std::size_t> label(t);
        std::iota(label.begin(), label.end(), std::size_t{0});
        for (std::size_t a = 0; a < t; ++a)
            for (std::size_t b = 0; b < a; ++b) {
                if (label[a] == label[b] || count_[a] == 1 || count_[b] == 1 || !apart(a, b)) continue;
                const std::size_t from = std::max(label[a], label[b]), to = std::min(label[a], label[b]);
                std::replace(label.begin(), label.end(), from, to);
            }
        std::vector<std::vector<std::size_t>> parts(t);
        for (std::size_t a = 0; a < t; ++a) parts[label[a]].push_back(a);
        std::vector<std::size_t> open;
        for (std::size_t one = 0; one < t; ++one)
            if (!parts[one].empty() && (parts[one].size() > 1 || count_[one] > 1)) open.push_back(one);
        if (open.size() > 1 && beyond(parts, open)) {
            std::vector<std::size_t> joined;
            for (std::size_t one : open) joined.insert(joined.end(), parts[one].begin(), parts[one].end()), parts[one].clear();
            std::sort(joined.begin(), joined.end());
            parts[joined[0]] = joined;
        }
        for (const std::vector<std::size_t>& part : parts)
            if (!part.empty()) out.add(of(part), 0.0);
    }

  private:
    const Held& held_;
    double tolerance_;
    std::size_t size_ = 0;
    std::vector<npy_int64> leaf_;
    std::vector<int> which_;
    std::vector<std::size_t> count_;
    std::vector<std::vector<double>> share_;
    mutable std::vector<double> joint_;

    // Whether the leaves of two tracks are further from being independent, in total variation, than is allowed.
    bool apart(std::size_t a, std::size_t b) const {
        const std::size_t h = held_.size(), columns = count_[b];
        joint_.assign(count_[a] * columns, 0.0);
        for (std::size_t i = 0; i < h; ++i) joint_[which_[a * h + i] * columns + which_[b * h + i]] += held_.weights[i];
        double beyond = 0.0;
        for (std::size_t i = 0; i < count_[a]; ++i)
            for (std::size_t j = 0; j < columns; ++j) beyond += std::max(0.0, joint_[i * columns + j] - share_[a][i] * share_[b][j]);
        return beyond > tolerance_;
    }

    // The same of all parts at once.
    bool beyond(const std::vector<std::vector<std::size_t>>& parts, const std::vector<std::size_t>& open) const {
        const std::size_t h = held_.size();
        std::vector<std::vector<int>> names(h);
        std::vector<double> product(h, 1.0);
        for (std::size_t one : open) {
            std::map<std::vector<int>, int> known;
            std::vector<double> total;
            for (std::size_t i = 0; i < h; ++i) {
                std::vector<int> own;
                for (std::size_t a : parts[one]) own.push_back(which_[a * h + i]);
                const auto [at, is_new] = known.try_emplace(own, static_cast<int>(known.size()));
                if (is_new) total.push_back(0.0);
                total[static_cast<std::size_t>(at->second)] += held_.weights[i];
                names[i].push_back(at->second);
            }
            for (std::size_t i = 0; i < h; ++i) product[i] *= total[static_cast<std::size_t>(names[i].back())];
        }
        std::map<std::vector<int>, std::pair<double, double>> joint;
        for (std::size_t i = 0; i < h; ++i) {
            auto& both = joint[names[i]];
            both.first += held_.weights[i], both.second = product[i];
        }
        double beyond = 0.0;
        for (const auto& [name, both] : joint) beyond += std::max(0.0, both.first - both.second);
        return beyond > tolerance_;
    }

    Held of(const std::vector<std::size_t>& part) const {
        Held own;
        for (std::size_t i = 0; i < held_.size(); ++i) {
            for (std::size_t a : part)
                if (leaf_[a * held_.size() + i] >= 0) own.leaves.push_back(leaf_[a * held_.size() + i]);
            own.close(held_.weights[i]);
        }
        drop_repetitions(own);
        return own;
    }
};

namespace entries {

inline const npy_bool* truths(PyObject* given, npy_intp& count) {
    if (!PyArray_CheckExact(given)) return nullptr;
    auto* array = reinterpret_cast<PyArrayObject*>(given);
    if (PyArray_TYPE(array) != NPY_BOOL || PyArray_NDIM(array) != 1 || !PyArray_IS_C_CONTIGUOUS(array)) return nullptr;
    count = PyArray_DIM(array, 0);
    return static_cast<const npy_bool*>(PyArray_DATA(array));
}

// Whether numbers ascend from `low` at least to `high` at most.
inline bool ascend(const Integers& numbers, npy_int64 low, npy_int64 high) {
    npy_int64 before = low;
    for (npy_intp i = 0; i < numbers.size(0); ++i) {
        if (numbers.data()[i] < before || numbers.data()[i] > high) return false;
        before = numbers.data()[i];
    }
    return true;
}

inline bool within(const Integers& numbers, npy_int64 high) {
    for (npy_intp i = 0; i < numbers.size(0); ++i)
        if (numbers.data()[i] < 0 || numbers.data()[i] >= high) return false;
    return true;
}

inline bool are_flat(const Integers& cluster, PyArrayObject* weights, const Integers& starts, const Integers& leaves, npy_intp l) {
    const npy_intp h = cluster.size(0);
    return PyArray_NDIM(weights) == 1 && PyArray_DIM(weights, 0) == h && starts.size(0) == h + 1 &&
           ascend(cluster, 0, NPY_MAX_INT32) && starts.data()[0] == 0 && ascend(starts, 0, leaves.size(0)) &&
           starts.data()[h] == leaves.size(0) && within(leaves, l);
}

// Numbers the codes, all below `most`, in their order; returns those that there are.
inline std::vector<npy_int64> numbered(std::vector<npy_int64>& codes, npy_int64 most) {
    std::vector<npy_int64> there;
    if (most <= 16 * static_cast<npy_int64>(codes.size()) + 4096) {
        std::vector<npy_int64> number(static_cast<std::size_t>(most), -1);
        for (npy_int64 code : codes) number[code] = 0;
        for (npy_int64 code = 0; code < most; ++code)
            if (number[code] == 0) number[code] = static_cast<npy_int64>(there.size()), there.push_back(code);
        for (npy_int64& code : codes) code = number[code];
        return there;
    }
    there = codes;
    std::sort(there.begin(), there.end());
    there.erase(std::unique(there.begin(), there.end()), there.end());
    for (npy_int64& code : codes) code = std::lower_bound(there.begin(), there.end(), code) - there.begin();
    return there;
}

inline PyObject* flattened(const Call& call, Flat& flat, npy_int64 most, bool with_lost) {
    const std::vector<npy_int64> codes = numbered(flat.held.leaves, most);
    npy_intp l = static_cast<npy_intp>(codes.size());
    npy_intp h = static_cast<npy_intp>(flat.held.size()), edges = h + 1, m = static_cast<npy_intp>(flat.held.leaves.size());
    npy_intp c = static_cast<npy_intp>(flat.lost.size());
    PyObject *cluster = copied(flat.cluster, NPY_INT64, 1, &h), *weights = copied(flat.held.weights, NPY_DOUBLE, 1, &h),
             *starts = copied(flat.held.starts, NPY_INT64, 1, &edges), *leaves = copied(flat.held.leaves, NPY_INT64, 1, &m),
             *rows = copied(codes, NPY_INT64, 1, &l);
    if (with_lost) return call.pack(cluster, weights, starts, leaves, rows, copied(flat.lost, NPY_DOUBLE, 1, &c));
    return call.pack(cluster, weights, starts, leaves, rows);
}

// Arguments: cluster (h,), weights (h,), starts (h+1,), leaves (m,), miss (l,), ends (l,), returns (p,), scores (p,), begins (k,),
// most, least.
inline PyObject* grow(Call& call, Args args) {
    const Integers cluster(args[0], 1), starts(args[2], 1), leaves(args[3], 1), ends(args[5], 1), returns(args[6], 1);
    PyArrayObject *weights = call.as_doubles(args[1], 1), *miss = call.as_doubles(args[4], 1), *scores = call.as_doubles(args[7], 1);
    npy_intp k = 0;
    const npy_bool* begins = truths(args[8], k);
    if (!call.ok || begins == nullptr || !cluster.good() || !starts.good() || !leaves.good() || !ends.good() || !returns.good())
        return nullptr;
    const long long most = PyLong_AsLongLong(args[9]);
    const double least = call.number(args[10]);
    if (!call.ok || PyErr_Occurred() || most < 1 || PyArray_NDIM(miss) != 1 || PyArray_NDIM(scores) != 1) return nullptr;
    const npy_intp l = PyArray_DIM(miss, 0), p = returns.size(0);
    if (!are_flat(cluster, weights, starts, leaves, l) || ends.size(0) != l || PyArray_DIM(scores, 0) != p || !ascend(ends, 0, p) ||
        (l > 0 ? ends.data()[l - 1] : 0) != p || !within(returns, k))
        return nullptr;
    const auto* score = static_cast<const double*>(PyArray_DATA(scores));
    const auto* missed = static_cast<const double*>(PyArray_DATA(miss));
    for (npy_intp i = 0; i < p; ++i)
        if (!std::isfinite(score[i])) return nullptr;
    for (npy_intp i = 0; i < l; ++i)
        if (!(missed[i] < std::numeric_limits<double>::infinity())) return nullptr;
    Flat flat;
    bool enough = true;
    Py_BEGIN_ALLOW_THREADS;
    try {
        Growth growth(ends.data(), returns.data(), score, missed, l, begins, k, most, least);
        growth.run(cluster.data(), static_cast<const double*>(PyArray_DATA(weights)), starts.data(), leaves.data(), cluster.size(0));
        flat = std::move(growth.out);
    } catch (const std::bad_alloc&) {
        enough = false;
    }
    Py_END_ALLOW_THREADS;
    return enough ? flattened(call, flat, l * (1 + k) + 1 + k, true) : PyErr_NoMemory();
}

// Arguments: cluster (h,), weights (h,), starts (h+1,), leaves (m,), track (l,), alive (l,), tolerance.
inline PyObject* shed(Call& call, Args args) {
    const Integers cluster(args[0], 1), starts(args[2], 1), leaves(args[3], 1), track(args[4], 1);
    PyArrayObject* weights = call.as_doubles(args[1], 1);
    npy_intp l = 0;
    const npy_bool* alive = truths(args[5], l);
    const double tolerance = call.number(args[6]);
    if (!call.ok || alive == nullptr || !cluster.good() || !starts.good() || !leaves.good() || !track.good() ||
        track.size(0) != l || !are_flat(cluster, weights, starts, leaves, l))
        return nullptr;
    const auto* weight = static_cast<const double*>(PyArray_DATA(weights));
    const npy_intp h = cluster.size(0);
    Flat flat;
    bool enough = true;
    Py_BEGIN_ALLOW_THREADS;
    try {
        Held held;
        std::vector<int> number(static_cast<std::size_t>(l), -1);
        for (npy_intp i = 0; i < h; ++i) {
            for (npy_int64 at = starts.data()[i]; at < starts.data()[i + 1]; ++at)
                if (alive[leaves.data()[at]]) held.leaves.push_back(leaves.data()[at]);
            held.close(weight[i]);
            if (i + 1 < h && cluster.data()[i + 1] == cluster.data()[i]) continue;
            if (!held.leaves.empty()) {
                if (held.size() > 1) drop_repetitions(held);
                Factors(held, track.data(), tolerance, number).split(flat);
            }
            held.clear();
        }
    } catch (const std::bad_alloc&) {
        enough = false;
    }
    Py_END_ALLOW_THREADS;
    return enough ? flattened(call, flat, l, false) : PyErr_NoMemory();
}

// Arguments: weights (h,), starts (h+1,), leaves (m,), track (l,), own (l,), names (l,).
inline PyObject* target_existence(Call& call, Args args) {
    const Integers starts(args[1], 1), leaves(args[2], 1), track(args[3], 1), names(args[5], 1);
    PyArrayObject *weights = call.as_doubles(args[0], 1), *own = call.as_doubles(args[4], 1);
    if (!call.ok || !starts.good() || !leaves.good() || !track.good() || !names.good() || PyArray_NDIM(weights) != 1 ||
        PyArray_NDIM(own) != 1)
        return nullptr;
    npy_intp l = track.size(0);
    const npy_intp h = PyArray_DIM(weights, 0), m = leaves.size(0);
    if (PyArray_DIM(own, 0) != l || names.size(0) != l || starts.size(0) != h + 1 || starts.data()[0] != 0 ||
        !ascend(starts, 0, m) || starts.data()[h] != m || !within(leaves, l) || !within(track, l))
        return nullptr;
    const auto* weight = static_cast<const double*>(PyArray_DATA(weights));
    const auto* exists = static_cast<const double*>(PyArray_DATA(own));
    try {
        const std::size_t size = static_cast<std::size_t>(l);
        std::vector<std::pair<npy_int64, npy_int64>> by_name(size), wanted;
        for (npy_intp i = 0; i < l; ++i) by_name[i] = {names.data()[i], i};
        std::sort(by_name.begin(), by_name.end());
        std::vector<npy_int64> number(size), seen(size, -1);
        npy_int64 count = 0;
        for (std::size_t i = 0; i < size; ++i) {
            count += i > 0 && by_name[i].first != by_name[i - 1].first;
            number[by_name[i].second] = count;
        }
        std::vector<double> of_track(size, 0.0), of_name(size, 0.0), mass(static_cast<std::size_t>(m));
        for (npy_intp i = 0; i < h; ++i)
            for (npy_int64 at = starts.data()[i]; at < starts.data()[i + 1]; ++at) {
                const npy_int64 leaf = leaves.data()[at];
                of_track[track.data()[leaf]] += mass[at] = weight[i] * exists[leaf];
                of_name[number[leaf]] += mass[at];
            }
        // Only where it is doubtful which track is the target's, hypotheses without the track are asked.
        for (npy_intp i = 0; i < l; ++i)
            if (of_track[track.data()[i]] < 1.0 - 1e-12 && of_name[number[i]] > 0.0) wanted.emplace_back(number[i], track.data()[i]);
        std::sort(wanted.begin(), wanted.end());
        wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
        std::vector<std::size_t> begin(size + 2, 0);
        for (const auto& pair : wanted) ++begin[pair.first + 1];
        for (std::size_t i = 0; i <= size; ++i) begin[i + 1] += begin[i];
        std::vector<double> others(wanted.size(), 0.0);
        for (npy_intp i = 0; i < h; ++i) {
            for (npy_int64 at = starts.data()[i]; at < starts.data()[i + 1]; ++at) seen[track.data()[leaves.data()[at]]] = i;
            for (npy_int64 at = starts.data()[i]; at < starts.data()[i + 1]; ++at) {
                const npy_int64 name = number[leaves.data()[at]];
                for (std::size_t one = begin[name]; one < begin[name + 1]; ++one)
                    if (seen[wanted[one].second] != i) others[one] += mass[at];
            }
        }
        PyObject* found = PyArray_SimpleNew(1, &l, NPY_DOUBLE);
        if (found == nullptr) return nullptr;
        auto* to = static_cast<double*>(PyArray_DATA(reinterpret_cast<PyArrayObject*>(found)));
        for (npy_intp i = 0; i < l; ++i) {
            const std::pair<npy_int64, npy_int64> pair{number[i], track.data()[i]};
            const auto at = std::lower_bound(wanted.begin(), wanted.end(), pair);
            const double more = at != wanted.end() && *at == pair ? others[at - wanted.begin()] : 0.0;
            to[i] = std::min(of_track[pair.second] + more, 1.0);
        }
        return found;
    } catch (const std::bad_alloc&) {
        return PyErr_NoMemory();
    }
}

}  // namespace entries
}  // namespace vedette
