// The k best assignments of rows to columns: Murty's partition of what is left. Each part is solved from its parent's by one
// shortest path over reduced costs, and only once its lower bound is the least that waits.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

namespace vedette {

class Ranking {
  public:
    Ranking() = default;
    Ranking(const double* cost, int rows, int columns) { take(cost, rows, columns); }

    // Takes another problem, in the memory of the one before.
    void take(const double* cost, int rows, int columns) {
        cost_ = cost, n_ = rows, m_ = columns, words_ = (columns + 63) / 64;
        starts_.assign(rows + 1, 0), owner_.assign(columns, 0), column_.assign(rows, 0);
        u_.assign(rows, 0.0), v_.assign(columns, 0.0), dist_.assign(columns, 0.0), in_.assign(columns, 0.0), bound_.assign(rows, 0.0);
        from_.assign(columns, 0), state_.assign(columns, kOpen), order_.assign(rows, 0), barred_.assign(words_, 0);
        edges_.clear(), costs_.clear(), us_.clear(), vs_.clear(), columns_.clear(), orders_.clear(), fixed_counts_.clear();
        excluded_.clear(), found.clear(), waiting_ = {};
        for (int r = 0; r < n_; ++r) {
            for (int j = 0; j < m_; ++j)
                if (cost[static_cast<std::ptrdiff_t>(r) * m_ + j] < kNone)
                    edges_.push_back({j, cost[static_cast<std::ptrdiff_t>(r) * m_ + j]});
            starts_[r + 1] = static_cast<int>(edges_.size());
        }
    }

    // Finds up to k assignments in ascending order of their costs, equal ones in that of their columns.
    void find(std::ptrdiff_t k) {
        if (k <= 0 || n_ > m_ || !solve_first()) return;
        for (int r = 0; r < n_; ++r) order_[r] = r;
        keep(0.0, 0);
        costs_[0] = sum(0);
        waiting_.push({costs_[0], 0, -1, 0});
        for (std::uint64_t made = 1; !waiting_.empty();) {
            const Part part = waiting_.top();
            waiting_.pop();
            if (part.position >= 0) {
                if (solve(part)) waiting_.push({costs_.back(), made++, -1, static_cast<int>(costs_.size()) - 1});
                continue;
            }
            found.emplace_back(sum(part.node), part.node);
            if (static_cast<std::ptrdiff_t>(found.size()) == k) break;
            divide(part.node, made);
        }
        std::sort(found.begin(), found.end(), [this](const auto& a, const auto& b) {
            const int *one = columns(a.second), *other = columns(b.second);
            return a.first != b.first ? a.first < b.first : std::lexicographical_compare(one, one + n_, other, other + n_);
        });
    }

    const int* columns(int node) const { return columns_.data() + static_cast<std::ptrdiff_t>(node) * n_; }

    const std::vector<double>& row_duals() const { return u_; }  // of the problem at hand; after find(1) the best one's
    const std::vector<double>& column_duals() const { return v_; }

    std::vector<std::pair<double, int>> found;  // cost and node

  private:
    static constexpr double kNone = std::numeric_limits<double>::infinity();
    static constexpr int kFree = -1, kSink = -1;  // no row owns the column; it was reached through the sink of free columns
    enum : char { kOpen, kTouched, kDone, kBlocked };

    struct Edge {
        int column;
        double cost;
    };

    // A part of what is left: the node that it is solved by, or (position >= 0) the one from which it is to be solved.
    struct Part {
        double bound;
        std::uint64_t made;
        int position, node;
        bool operator<(const Part& other) const {
            return bound != other.bound ? bound > other.bound : made > other.made;
        }
    };

    const double* cost_ = nullptr;
    int n_ = 0, m_ = 0, words_ = 0;
    std::vector<int> starts_;
    std::vector<Edge> edges_;
    // The problem at hand: who owns a column, each row's column, the duals; c - u - v >= 0, and 0 where a row owns the column;
    // v >= 0 where a column is free, else <= 0.
    std::vector<int> owner_, column_;
    std::vector<double> u_, v_, dist_;
    std::vector<int> from_, touched_;
    std::vector<char> state_;
    std::vector<double> in_, bound_;
    std::vector<int> order_;
    std::vector<std::uint64_t> barred_;  // columns that the row which gets another one may not have
    // All nodes: columns, the order of rows (fixed ones, the one with excluded columns, the rest), duals, excluded columns.
    std::vector<double> costs_, us_, vs_;
    std::vector<int> columns_, orders_, fixed_counts_;
    std::vector<std::uint64_t> excluded_;
    std::priority_queue<Part> waiting_;

    double at(int row, int column) const { return cost_[static_cast<std::ptrdiff_t>(row) * m_ + column]; }

    double sum(int node) const {
        double total = 0.0;
        for (int r = 0; r < n_; ++r) total += at(r, columns(node)[r]);
        return total;
    }

    void keep(double cost, int fixed) {
        costs_.push_back(cost);
        columns_.insert(columns_.end(), column_.begin(), column_.end());
        orders_.insert(orders_.end(), order_.begin(), order_.end());
        us_.insert(us_.end(), u_.begin(), u_.end());
        vs_.insert(vs_.end(), v_.begin(), v_.end());
        fixed_counts_.push_back(fixed);
        excluded_.insert(excluded_.end(), barred_.begin(), barred_.end());
    }

    const std::uint64_t* excluded(int node) const { return excluded_.data() + static_cast<std::ptrdiff_t>(node) * words_; }
    static bool has(const std::uint64_t* set, int j) { return set[j >> 6] >> (j & 63) & 1; }

    // Takes a node's assignment and duals as the problem at hand; its first `fixed` rows and their columns are out of play.
    void load(int node, int fixed) {
        const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(node) * n_, column = static_cast<std::ptrdiff_t>(node) * m_;
        std::copy_n(columns_.begin() + row, n_, column_.begin());
        std::copy_n(orders_.begin() + row, n_, order_.begin());
        std::copy_n(us_.begin() + row, n_, u_.begin());
        std::copy_n(vs_.begin() + column, m_, v_.begin());
        std::fill(owner_.begin(), owner_.end(), kFree);
        std::fill(state_.begin(), state_.end(), kOpen);
        for (int r = 0; r < n_; ++r) owner_[column_[r]] = r;
        for (int p = 0; p < fixed; ++p) state_[column_[order_[p]]] = kBlocked;
    }

    // The best assignment of all rows, by a shortest path for each.
    bool solve_first() {
        std::fill(owner_.begin(), owner_.end(), kFree);
        for (int r = 0; r < n_; ++r) {
            std::fill(state_.begin(), state_.end(), kOpen);
            if (shortest(r, -1) == kNone) return false;
        }
        return true;
    }

    // The parts of a node's rest: in one each row that is not fixed may not have its column, and those before it keep theirs.
    // A row's new column costs at least the least reduced cost of another, and so does the use made of the one it leaves.
    void divide(int node, std::uint64_t& made) {
        const int fixed = fixed_counts_[node];
        load(node, fixed);
        const std::uint64_t* barred = excluded(node);
        const int own = fixed < n_ ? order_[fixed] : -1;
        for (int j = 0; j < m_; ++j) in_[j] = owner_[j] == kFree ? 0.0 : -v_[j];
        for (int p = fixed; p < n_; ++p) {
            const int r = order_[p];
            double least = kNone;
            for (int e = starts_[r]; e < starts_[r + 1]; ++e) {
                const int j = edges_[e].column;
                if (j == column_[r] || state_[j] == kBlocked || (r == own && has(barred, j))) continue;
                const double reduced = edges_[e].cost - u_[r] - v_[j];
                least = reduced < least ? reduced : least;
                in_[j] = reduced < in_[j] ? reduced : in_[j];
            }
            bound_[r] = least;
        }
        for (int p = fixed; p < n_; ++p) bound_[order_[p]] += in_[column_[order_[p]]];
        // The largest parts, which fix fewest rows, get the largest bounds.
        std::stable_sort(order_.begin() + fixed + (node > 0), order_.end(),
                         [this](int a, int b) { return bound_[a] > bound_[b]; });
        std::copy(order_.begin(), order_.end(), orders_.begin() + static_cast<std::ptrdiff_t>(node) * n_);
        for (int p = fixed; p < n_; ++p) {
            const double bound = bound_[order_[p]];
            if (bound < kNone) waiting_.push({costs_[node] + (bound > 0.0 ? bound : 0.0), made++, p, node});
        }
    }

    bool solve(const Part& part) {
        load(part.node, part.position);
        const int row = order_[part.position], gone = column_[row];
        std::fill(barred_.begin(), barred_.end(), 0);
        if (part.position == fixed_counts_[part.node]) std::copy_n(excluded(part.node), words_, barred_.begin());
        barred_[gone >> 6] |= std::uint64_t{1} << (gone & 63);
        const double more = shortest(row, gone);
        if (more == kNone) return false;
        keep(costs_[part.node] + (more > 0.0 ? more : 0.0), part.position);
        return true;
    }

    // Gives `row` another column than `gone`, which becomes free unless another row takes it, or (gone < 0) a first one.
    // Returns what that costs, or infinity if it cannot be. All free columns lead to a sink, and from there to those in use,
    // as a row may also leave its column for `gone`, which leaves that one free.
    double shortest(int row, int gone) {
        touched_.clear();
        double sink = kNone, total = kNone, reached = 0.0;
        int sink_from = -1, last = -1, current = row;
        bool sunk = false;
        for (;;) {
            for (int e = starts_[current]; e < starts_[current + 1]; ++e) {
                const int j = edges_[e].column;
                if (state_[j] >= kDone || (current == row && has(barred_.data(), j))) continue;
                relax(j, reached + (edges_[e].cost - u_[current] - v_[j]), current);
            }
            for (current = -1; current < 0;) {
                int best = -1;
                double least = kNone;
                for (int i = 0; i < static_cast<int>(touched_.size()); ++i)
                    if (dist_[touched_[i]] < least) least = dist_[touched_[i]], best = i;
                if (best < 0 && sink == kNone) return kNone;
                if (!sunk && sink <= least) {
                    sunk = true, reached = sink;
                    if (gone < 0) break;
                    for (int j = 0; j < m_; ++j)
                        if (state_[j] < kDone && (owner_[j] != kFree || j == gone)) relax(j, sink - v_[j], kSink);
                    continue;
                }
                if (best < 0) return kNone;
                const int j = touched_[best];
                touched_[best] = touched_.back(), touched_.pop_back();
                state_[j] = kDone, reached = least;
                if (j == gone) {
                    last = j;
                    break;
                }
                if (owner_[j] != kFree)
                    current = owner_[j];
                else if (!sunk && dist_[j] + v_[j] < sink)  // later, only by rounding, and through itself
                    sink = dist_[j] + v_[j], sink_from = j;
            }
            if (current < 0) break;
        }
        total = reached;
        if (last < 0) last = sink_from;
        // The duals, with the sink's at 0.
        const double lower = sunk ? total - sink : 0.0;
        for (int j = 0; j < m_; ++j) {
            if (state_[j] != kDone) continue;
            const double by = total - dist_[j];
            v_[j] -= by;
            if (owner_[j] != kFree && j != gone) u_[owner_[j]] += by;
        }
        u_[row] += total;
        if (lower != 0.0) {
            for (double& v : v_) v += lower;
            for (double& u : u_) u -= lower;
        }
        // The path back.
        for (int j = last;;) {
            if (from_[j] == kSink) {
                owner_[j] = kFree;
                j = sink_from;
                continue;
            }
            const int r = from_[j], before = column_[r];
            owner_[j] = r, column_[r] = j;
            if (r == row) break;
            j = before;
        }
        return total;
    }

    void relax(int j, double reached, int from) {
        if (state_[j] == kOpen)
            state_[j] = kTouched, touched_.push_back(j);
        else if (reached >= dist_[j])
            return;
        dist_[j] = reached, from_[j] = from;
    }
};

}  // namespace vedette
