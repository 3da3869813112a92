// Marginals of all joint associations of a scan, each cluster summed by itself.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "matchings.hpp"
#include "ranking.hpp"

namespace vedette {

// Tracks and the returns that each may take: track i's are those of e from starts[i] to starts[i + 1], in their order. Log scores
// of the pairs, and of each track's miss.
struct Meetings {
    std::vector<int> starts{0}, returns;
    std::vector<double> scores, miss;

    int tracks() const { return static_cast<int>(miss.size()); }
    void clear() { starts.assign(1, 0), returns.clear(), scores.clear(), miss.clear(); }
    void close(double score) { miss.push_back(score), starts.push_back(static_cast<int>(returns.size())); }
};

// The association weights of one scan.
class Joint {
  public:
    Joint(int returns, int most) : most_(most), users_(returns), one_user_(returns), number_(returns, -1) {}

    // Weights of the pairs and of misses (t), or null if only the tracks of clusters that are too wide are asked for; wide (t).
    // A track of such a cluster gets the weights that it would have alone.
    void run(const Meetings& met, double* weights, double* misses, bool* wide) {
        met_ = &met, t_ = met.tracks();
        group_.resize(t_), stay_.resize(t_);
        std::fill_n(wide, t_, false);
        link();
        if (misses != nullptr)
            for (int i = 0; i < t_; ++i) alone(i, weights, misses);
        // Clusters: tracks of a group, in the order of their first ones.
        for (int first = 0; first < t_; ++first) {
            if (root(first) != first || next_[first] < 0) continue;
            tracks_.clear();
            for (int i = first; i >= 0; i = next_[i]) tracks_.push_back(i);
            sum(weights, misses, wide);
        }
    }

  private:
    static constexpr double kLeastNormal = std::numeric_limits<double>::min();
    static constexpr double kLeastMiss = -3000.0;  // a miss is that likely at least, beside the best, in case nothing else is left
    static constexpr double kSafe = 500.0;         // in a sum whose largest term is above exp(-kSafe) nothing that counts is lost

    const Meetings* met_ = nullptr;
    int t_ = 0, most_;
    std::vector<int> users_, one_user_, number_, group_, next_, last_;
    std::vector<int> tracks_, track_, return_, shared_;
    std::vector<double> stay_, gain_, weight_, free_track_, free_return_, cost_;
    Side by_track_, by_return_;
    Sums sums_;

    int begin(int i) const { return met_->starts[i]; }
    int end(int i) const { return met_->starts[i + 1]; }
    bool shares(int e) const { return users_[met_->returns[e]] > 1; }

    int root(int i) {
        while (group_[i] != i) i = group_[i] = group_[group_[i]];
        return i;
    }

    // Groups tracks that share returns, directly or through others; the smallest number stands for each. Who shares one with
    // nobody has no next.
    void link() {
        std::fill(users_.begin(), users_.end(), 0);
        for (int i = 0; i < t_; ++i) group_[i] = i;
        for (int i = 0; i < t_; ++i)
            for (int e = begin(i); e < end(i); ++e) {
                const int j = met_->returns[e];
                if (users_[j]++ == 0) {
                    one_user_[j] = i;
                    continue;
                }
                const int a = root(i), b = root(one_user_[j]);
                group_[std::max(a, b)] = std::min(a, b);
            }
        next_.assign(t_, -1), last_.assign(t_, -1);
        for (int i = 0; i < t_; ++i) {
            const int first = root(i);
            if (last_[first] >= 0) next_[last_[first]] = i;
            last_[first] = i;
        }
    }

    double least_miss(int i) const {
        double best = met_->miss[i];
        for (int e = begin(i); e < end(i); ++e) best = std::max(best, met_->scores[e]);
        return std::max(met_->miss[i], best + kLeastMiss);
    }

    void alone(int i, double* weights, double* misses) const {
        const double miss = least_miss(i);
        double best = miss;
        for (int e = begin(i); e < end(i); ++e) best = std::max(best, met_->scores[e]);
        double total = misses[i] = std::exp(miss - best);
        for (int e = begin(i); e < end(i); ++e) total += weights[e] = std::exp(met_->scores[e] - best);
        misses[i] = normal(misses[i] / total);
        for (int e = begin(i); e < end(i); ++e) weights[e] = normal(weights[e] / total);
    }

    static double normal(double weight) { return weight < kLeastNormal ? 0.0 : weight; }

    void sum(double* weights, double* misses, bool* wide) {
        const int t = static_cast<int>(tracks_.size());
        track_.clear(), return_.clear(), shared_.clear();
        for (int a = 0; a < t; ++a)
            for (int e = begin(tracks_[a]); e < end(tracks_[a]); ++e) {
                if (!shares(e)) continue;
                const int j = met_->returns[e];
                track_.push_back(a), return_.push_back(j);
                if (number_[j] < 0) number_[j] = 0, shared_.push_back(j);
            }
        std::sort(shared_.begin(), shared_.end());
        const int shared = static_cast<int>(shared_.size());
        for (int b = 0; b < shared; ++b) number_[shared_[b]] = b;
        for (int& j : return_) j = number_[j];
        for (int j : shared_) number_[j] = -1;
        by_track_.build(t, shared, track_, return_), by_return_.build(shared, t, return_, track_);
        const double through_tracks = by_track_.plan(most_, by_return_), through_returns = by_return_.plan(most_, by_track_);
        if (std::min(through_tracks, through_returns) == std::numeric_limits<double>::infinity()) {
            for (int i : tracks_) wide[i] = true;
            return;
        }
        if (misses == nullptr) return;
        scale(t, shared);
        const bool tracks_first = through_tracks <= through_returns;
        if (tracks_first)
            sums_.run(by_track_, free_track_, free_return_, weight_, through_tracks);
        else
            sums_.run(by_return_, free_return_, free_track_, weight_, through_returns);
        share(weights, misses, tracks_first ? sums_.rows : sums_.columns);
    }

    // Weights of at most 1 for each part of an association. Staying off the shared returns is one thing, be it for a miss or for
    // returns that no other track wants. Where a common scale might lose the sum's largest term, the dual numbers of the best
    // association make that one's parts 1.
    void scale(int t, int shared) {
        gain_.clear(), free_track_.assign(t, 1.0), free_return_.assign(shared, 1.0);
        double most = 0.0;
        for (int a = 0, f = 0; a < t; ++a) {
            const int i = tracks_[a];
            const double miss = least_miss(i);
            double best = miss, total = 0.0, top = 0.0;
            for (int e = begin(i); e < end(i); ++e)
                if (!shares(e)) best = std::max(best, met_->scores[e]);
            total = std::exp(miss - best);
            for (int e = begin(i); e < end(i); ++e)
                if (!shares(e)) total += std::exp(met_->scores[e] - best);
            stay_[i] = best + std::log(total);
            for (int e = begin(i); e < end(i); ++e) {
                if (!shares(e)) continue;
                gain_.push_back(met_->scores[e] - stay_[i]);
                top = std::max(top, gain_.back());
            }
            most += top;
            free_track_[a] = -top;
            for (; f < static_cast<int>(gain_.size()); ++f) gain_[f] -= top;
        }
        if (most > kSafe) balance(t, shared);
        for (double& log : gain_) log = std::exp(log);
        weight_.swap(gain_);
        for (double& log : free_track_) log = std::exp(log);
    }

    void balance(int t, int shared) {
        const int columns = shared + t;
        cost_.assign(static_cast<std::size_t>(t) * columns, std::numeric_limits<double>::infinity());
        for (std::size_t e = 0; e < gain_.size(); ++e) cost_[static_cast<std::size_t>(track_[e]) * columns + return_[e]] = -gain_[e];
        for (int a = 0; a < t; ++a) cost_[static_cast<std::size_t>(a) * columns + shared + a] = -free_track_[a];
        Ranking best(cost_.data(), t, columns);
        best.find(1);
        const std::vector<double>&u = best.row_duals(), &v = best.column_duals();
        for (std::size_t e = 0; e < gain_.size(); ++e)
            gain_[e] = std::min(0.0, gain_[e] + u[track_[e]] + v[return_[e]]) + v[shared + track_[e]];
        for (int a = 0; a < t; ++a) free_track_[a] = std::min(0.0, free_track_[a] + u[a] + v[shared + a]);
        for (int b = 0; b < shared; ++b) free_return_[b] = std::exp(v[b]);
    }

    // Writes the weights: the shared returns' own, and what is left of each track to its miss and its own returns.
    void share(double* weights, double* misses, const std::vector<double>& free) {
        std::size_t f = 0;
        for (std::size_t a = 0; a < tracks_.size(); ++a) {
            const int i = tracks_[a];
            double total = free[a];
            for (std::size_t g = f; g < track_.size() && track_[g] == static_cast<int>(a); ++g) total += sums_.edges[g];
            const double rest = free[a] / total, stay = stay_[i];
            misses[i] = normal(rest * std::exp(least_miss(i) - stay));
            for (int e = begin(i); e < end(i); ++e)
                weights[e] = normal(shares(e) ? sums_.edges[f++] / total : rest * std::exp(met_->scores[e] - stay));
        }
    }
};

}  // namespace vedette
