// Marginals of all joint associations, summed exactly. In each cluster one side, tracks or returns, is gone through row by row; what
// counts of those before is which of the other side's columns, of those that later rows can still take, they took. So the sums are
// over the sets of open columns, 2^open at most, and the order of rows keeps few open.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "ranking.hpp"

namespace vedette {

constexpr int kMostOpen = 16;          // columns open at once
constexpr double kMostSets = 1 << 22;  // sets of open columns, over all rows of a cluster

// One side of a cluster as rows, each with its columns; an edge is the number of a pair of track and return.
struct Side {
    std::vector<int> starts, columns, edges, degrees, order;
    int rows = 0;

    void build(int count, int others, const std::vector<int>& row, const std::vector<int>& column) {
        rows = count;
        starts.assign(count + 1, 0), degrees.assign(others, 0), columns.resize(row.size()), edges.resize(row.size());
        for (int r : row) ++starts[r + 1];
        for (int r = 0; r < count; ++r) starts[r + 1] += starts[r];
        std::vector<int>& next = order;
        next.assign(starts.begin(), starts.end() - 1);
        for (int e = 0; e < static_cast<int>(row.size()); ++e) {
            const int at = next[row[e]]++;
            columns[at] = column[e], edges[at] = e;
            ++degrees[column[e]];
        }
    }

    // Orders the rows so that few columns are open at once: next is always the one after which fewest are, then the one during
    // which fewest are, then the first. Returns the sum over rows of 2^open, or infinity if more than `most` would be open.
    // `across` is the other side: which rows a column is in. How many columns a row would open and close is kept up to date.
    double plan(int most, const Side& across) {
        std::vector<int> left(degrees), waiting(rows), opened(rows), closed(rows, 0);
        for (int r = 0; r < rows; ++r) {
            waiting[r] = r, opened[r] = starts[r + 1] - starts[r];
            for (int i = starts[r]; i < starts[r + 1]; ++i) closed[r] += degrees[columns[i]] == 1;
        }
        int open = 0;
        double states = 0.0;
        order.clear();
        while (!waiting.empty()) {
            std::size_t best = waiting.size();
            int least = std::numeric_limits<int>::max(), lowest = least;
            for (std::size_t w = 0; w < waiting.size(); ++w) {
                const int r = waiting[w], during = open + opened[r], after = during - closed[r];
                if (during <= most && (after < least || (after == least && during < lowest))) best = w, least = after, lowest = during;
            }
            if (best == waiting.size()) return std::numeric_limits<double>::infinity();
            const int row = waiting[best];
            waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(best));
            open = least;
            order.push_back(row);
            for (int i = starts[row]; i < starts[row + 1]; ++i) {
                const int column = columns[i], opens = left[column] == degrees[column], closes = --left[column] == 1;
                if (!opens && !closes) continue;
                for (int j = across.starts[column]; j < across.starts[column + 1]; ++j)
                    opened[across.columns[j]] -= opens, closed[across.columns[j]] += closes;
            }
            states += std::ldexp(1.0, lowest);
        }
        return states <= kMostSets ? states : std::numeric_limits<double>::infinity();
    }
};

// Sums over all matchings of rows with columns: each row takes one column with the edge's weight, or none with weight `free_row`;
// a column that no row takes has the weight `free_column`. Gives for each row and column the probability to stay free, and for
// each edge that it is taken.
class Sums {
  public:
    std::vector<double> rows, columns, edges;

    void run(const Side& side, const std::vector<double>& free_row, const std::vector<double>& free_column,
             const std::vector<double>& weight, double sets) {
        before_.reserve(static_cast<std::size_t>(3.0 * sets) + 1);
        const int count = static_cast<int>(side.degrees.size());
        rows.assign(side.rows, 0.0), columns.assign(count, 0.0), edges.assign(weight.size(), 0.0);
        stages_.clear(), places_.clear(), place_.assign(count, -1), left_ = side.degrees;
        before_.assign(1, 1.0);
        std::ptrdiff_t at = 0;
        for (int row : side.order) {
            at = take(side, row, free_row[row], weight, at);
            for (int i = side.starts[row]; i < side.starts[row + 1]; ++i)
                if (--left_[side.columns[i]] == 0) at = close(side.columns[i], free_column[side.columns[i]], at);
        }
        const double total = before_[at];
        after_.assign(1, 1.0 / total);
        for (auto stage = stages_.rbegin(); stage != stages_.rend(); ++stage) {
            if (stage->row < 0)
                open_again(*stage, free_column[stage->column]);
            else
                give_back(*stage, side, free_row[stage->row], weight);
        }
    }

  private:
    // A row that takes one of the open columns, `opened` of them new, or (row < 0) the end of the column in one place.
    struct Stage {
        int row, column, place, open, opened;
        std::ptrdiff_t at;  // where the sums before it are
        std::size_t taken;  // where the places of the row's columns are
    };

    std::vector<Stage> stages_;
    std::vector<int> places_, place_, left_, taken_;
    std::vector<double> before_, after_, next_;  // sums by sets of open columns: before each stage; from the last one backward

    std::ptrdiff_t take(const Side& side, int row, double free, const std::vector<double>& weight, std::ptrdiff_t at) {
        const int open = static_cast<int>(places_.size());
        Stage stage{row, -1, -1, open, 0, at, taken_.size()};
        for (int i = side.starts[row]; i < side.starts[row + 1]; ++i) {
            int& place = place_[side.columns[i]];
            if (place < 0) place = static_cast<int>(places_.size()), places_.push_back(side.columns[i]), ++stage.opened;
            taken_.push_back(place);
        }
        const std::ptrdiff_t size = std::ptrdiff_t{1} << open, to = static_cast<std::ptrdiff_t>(before_.size());
        before_.resize(before_.size() + (size << stage.opened), 0.0);
        const double* from = before_.data() + at;
        double* sums = before_.data() + to;
        for (std::ptrdiff_t s = 0; s < size; ++s) sums[s] = free * from[s];
        for (int i = side.starts[row]; i < side.starts[row + 1]; ++i) {
            const double w = weight[side.edges[i]];
            const std::ptrdiff_t bit = std::ptrdiff_t{1} << taken_[stage.taken + i - side.starts[row]];
            if (bit >= size) {
                for (std::ptrdiff_t s = 0; s < size; ++s) sums[bit + s] = w * from[s];
            } else {
                for (std::ptrdiff_t base = 0; base < size; base += 2 * bit)
                    for (std::ptrdiff_t s = base; s < base + bit; ++s) sums[s + bit] += w * from[s];
            }
        }
        stages_.push_back(stage);
        return to;
    }

    std::ptrdiff_t close(int column, double free, std::ptrdiff_t at) {
        const int open = static_cast<int>(places_.size()), place = place_[column];
        stages_.push_back({-1, column, place, open, 0, at, 0});
        places_.erase(places_.begin() + place);
        for (int p = place; p < open - 1; ++p) place_[places_[p]] = p;
        const std::ptrdiff_t size = std::ptrdiff_t{1} << open, bit = std::ptrdiff_t{1} << place;
        const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(before_.size());
        before_.resize(before_.size() + size / 2);
        const double* from = before_.data() + at;
        double* sums = before_.data() + to;
        for (std::ptrdiff_t base = 0; base < size; base += 2 * bit, sums += bit)
            for (std::ptrdiff_t s = 0; s < bit; ++s) sums[s] = free * from[base + s] + from[base + bit + s];
        return to;
    }

    void open_again(const Stage& stage, double free) {
        const std::ptrdiff_t size = std::ptrdiff_t{1} << stage.open, bit = std::ptrdiff_t{1} << stage.place;
        next_.resize(size);
        const double *from = before_.data() + stage.at, *after = after_.data();
        double sum = 0.0;
        for (std::ptrdiff_t base = 0; base < size; base += 2 * bit, after += bit)
            for (std::ptrdiff_t s = 0; s < bit; ++s) {
                sum += from[base + s] * after[s];
                next_[base + s] = free * after[s];
                next_[base + bit + s] = after[s];
            }
        columns[stage.column] = free * sum;
        after_.swap(next_);
    }

    void give_back(const Stage& stage, const Side& side, double free, const std::vector<double>& weight) {
        const std::ptrdiff_t size = std::ptrdiff_t{1} << stage.open;
        const double *from = before_.data() + stage.at, *after = after_.data();
        next_.resize(size);
        rows[stage.row] = free * dot(from, after, size);
        for (std::ptrdiff_t s = 0; s < size; ++s) next_[s] = free * after[s];
        for (int i = side.starts[stage.row]; i < side.starts[stage.row + 1]; ++i) {
            const double w = weight[side.edges[i]];
            const std::ptrdiff_t bit = std::ptrdiff_t{1} << taken_[stage.taken + i - side.starts[stage.row]];
            double sum = 0.0;
            if (bit >= size) {
                sum = dot(from, after + bit, size);
                for (std::ptrdiff_t s = 0; s < size; ++s) next_[s] += w * after[bit + s];
            } else {
                for (std::ptrdiff_t base = 0; base < size; base += 2 * bit) {
                    sum += dot(from + base, after + base + bit, bit);
                    for (std::ptrdiff_t s = base; s < base + bit; ++s) next_[s] += w * after[s + bit];
                }
            }
            edges[side.edges[i]] = w * sum;
        }
        after_.swap(next_);
    }

    // Four sums side by side, as each addition waits for the one before.
    static double dot(const double* a, const double* b, std::ptrdiff_t size) {
        double sums[4] = {};
        std::ptrdiff_t s = 0;
        for (; s + 4 <= size; s += 4)
            for (int lane = 0; lane < 4; ++lane) sums[lane] += a[s + lane] * b[s + lane];
        for (; s < size; ++s) sums[0] += a[s] * b[s];
        return (sums[0] + sums[1]) + (sums[2] + sums[3]);
    }
};

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
