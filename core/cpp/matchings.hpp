// Sums over all matchings, exactly. One side of a cluster, tracks or returns, is gone through row by row; what counts of those
// before is which of the other side's columns, of those that later rows can still take, they took. So the sums are over the sets
// of open columns, 2^open at most, and the order of rows keeps few open.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

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

}  // namespace vedette
