// How the hypotheses of clusters grow by a scan: the best associations of each, and of these the heaviest. As `clusters.py`.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>

#include "held.hpp"
#include "hypotheses.hpp"

namespace vedette {

constexpr double kMostOperations = 4096;  // as `MOST_OPERATIONS` of the reference

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

}  // namespace vedette
