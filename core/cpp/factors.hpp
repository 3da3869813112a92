// What of a cluster's hypotheses is independent: parts of its tracks whose leaves say nothing of each other. As `clusters.py`.
#pragma once

#include <algorithm>
#include <map>
#include <numeric>

#include "held.hpp"

namespace vedette {

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

}  // namespace vedette
