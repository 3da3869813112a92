// Which points lie in which boxes: points are sorted into the cells of a grid over up to two axes that do not wrap.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "kernels.hpp"

namespace vedette {

class Grid {
  public:
    Grid(const double* points, std::ptrdiff_t count, int axes, const Periods& periods)
        : points_(points), axes_(axes), period_(axes, 0.0) {
        for (int i = 0; i < periods.count; ++i) period_[periods.each[i].axis] = periods.each[i].period;
        for (int a = 0; a < axes && used_ < 2; ++a)
            if (period_[a] == 0.0) along_[used_++] = a;
        const int cells = std::clamp(static_cast<int>(used_ == 2 ? std::sqrt(count / 2.0) : count / 2.0), 1, 2048);
        for (int i = 0; i < used_; ++i) {
            double low = std::numeric_limits<double>::infinity(), high = -low;
            for (std::ptrdiff_t p = 0; p < count; ++p) {
                const double x = points[p * axes + along_[i]];
                if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
            }
            if (!(high > low)) continue;
            from_[i] = low, cells_[i] = cells, per_unit_[i] = cells / (high - low);
        }
        starts_.assign(static_cast<std::size_t>(cells_[0]) * cells_[1] + 1, 0);
        std::vector<int> cell(static_cast<std::size_t>(count), -1);
        for (std::ptrdiff_t p = 0; p < count; ++p) {
            const double* point = points + p * axes;
            if (!std::all_of(point, point + axes, [](double x) { return std::isfinite(x); })) continue;
            const int x = used_ > 0 ? place(0, point[along_[0]]) : 0, y = used_ > 1 ? place(1, point[along_[1]]) : 0;
            ++starts_[(cell[p] = x * cells_[1] + y) + 1];
        }
        for (std::size_t c = 1; c < starts_.size(); ++c) starts_[c] += starts_[c - 1];
        sorted_.resize(starts_.back());
        std::vector<int> next(starts_.begin(), starts_.end() - 1);
        for (std::ptrdiff_t p = 0; p < count; ++p)
            if (cell[p] >= 0) sorted_[next[cell[p]]++] = static_cast<int>(p);
    }

    // Appends the points from `low` to `high`, in ascending order.
    void find(const double* low, const double* high, std::vector<std::int64_t>& found) const {
        int first[2] = {}, last[2] = {};
        for (int i = 0; i < used_; ++i) first[i] = place(i, low[along_[i]]), last[i] = place(i, high[along_[i]]);
        const std::size_t before = found.size();
        for (int x = first[0]; x <= last[0]; ++x)
            for (int s = starts_[x * cells_[1] + first[1]], end = starts_[x * cells_[1] + last[1] + 1]; s < end; ++s)
                if (holds(low, high, points_ + static_cast<std::ptrdiff_t>(sorted_[s]) * axes_)) found.push_back(sorted_[s]);
        std::sort(found.begin() + static_cast<std::ptrdiff_t>(before), found.end());
    }

  private:
    const double* points_;
    int axes_, used_ = 0, along_[2] = {}, cells_[2] = {1, 1};
    double from_[2] = {}, per_unit_[2] = {};
    std::vector<double> period_;
    std::vector<int> starts_, sorted_;

    int place(int i, double x) const {
        const double cell = (x - from_[i]) * per_unit_[i];
        return cell >= cells_[i] - 1 ? cells_[i] - 1 : cell > 0.0 ? static_cast<int>(cell) : 0;
    }

    bool holds(const double* low, const double* high, const double* point) const {
        for (int a = 0; a < axes_; ++a) {
            if (period_[a] == 0.0) {
                if (!(point[a] >= low[a] && point[a] <= high[a])) return false;
            } else {
                const double above = (point[a] - low[a]) / period_[a];
                if (!((above - std::floor(above)) * period_[a] <= high[a] - low[a])) return false;
            }
        }
        return true;
    }
};

}  // namespace vedette
