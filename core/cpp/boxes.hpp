// Which points lie in which boxes: points are sorted into the cells of a grid over up to two axes that do not
// wrap, those of a crowded cell into a grid of their own: so what lies far away makes no search longer.
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
        std::vector<int> finite;
        for (std::ptrdiff_t p = 0; p < count; ++p)
            if (std::all_of(points + p * axes, points + (p + 1) * axes, [](double x) { return std::isfinite(x); }))
                finite.push_back(static_cast<int>(p));
        all_ = cut(finite);
    }

    // Appends the points from `low` to `high`, in ascending order.
    void find(const double* low, const double* high, std::vector<std::int64_t>& found) const {
        const std::size_t before = found.size();
        find_in(all_, low, high, found);
        std::sort(found.begin() + static_cast<std::ptrdiff_t>(before), found.end());
    }

  private:
    static constexpr int kMost = 32;  // of a cell in which there is no grid: of points that are spread evenly it has two

    // Cells over some points: those of each, and in place of too many a grid of their own, for the cell whose number it has.
    struct Cells {
        double from[2] = {}, per_unit[2] = {};
        int count[2] = {1, 1};
        std::vector<int> starts, sorted, crowded;
        std::vector<Cells> within;

        int place(int i, double x) const {
            const double cell = (x - from[i]) * per_unit[i];
            return cell >= count[i] - 1 ? count[i] - 1 : cell > 0.0 ? static_cast<int>(cell) : 0;
        }
    };

    const double* points_;
    int axes_, used_ = 0, along_[2] = {};
    std::vector<double> period_;
    Cells all_;

    const double* at(int point) const { return points_ + static_cast<std::ptrdiff_t>(point) * axes_; }

    Cells cut(const std::vector<int>& some) const {
        Cells cells;
        const double size = static_cast<double>(some.size()) / 2.0;
        const int wanted = std::clamp(static_cast<int>(used_ == 2 ? std::sqrt(size) : size), 1, 2048);
        for (int i = 0; i < used_; ++i) {
            double low = std::numeric_limits<double>::infinity(), high = -low;
            for (int p : some) low = std::min(low, at(p)[along_[i]]), high = std::max(high, at(p)[along_[i]]);
            const double per_unit = wanted / (high - low);
            if (!std::isfinite(per_unit) || !(per_unit > 0.0)) continue;
            cells.from[i] = low, cells.count[i] = wanted, cells.per_unit[i] = per_unit;
        }
        std::vector<int> cell, number(static_cast<std::size_t>(cells.count[0]) * cells.count[1], 0);
        for (int p : some) {
            const int x = used_ > 0 ? cells.place(0, at(p)[along_[0]]) : 0, y = used_ > 1 ? cells.place(1, at(p)[along_[1]]) : 0;
            cell.push_back(x * cells.count[1] + y);
            ++number[cell.back()];
        }
        const auto is_crowded = [&](int c) { return number[c] > kMost && number[c] < static_cast<int>(some.size()); };
        cells.starts.assign(1, 0);
        for (int c = 0; c < static_cast<int>(number.size()); ++c) {
            if (is_crowded(c)) cells.crowded.push_back(c);
            cells.starts.push_back(cells.starts.back() + (is_crowded(c) ? 0 : number[c]));
        }
        cells.sorted.resize(cells.starts.back());
        std::vector<int> next(cells.starts.begin(), cells.starts.end() - 1);
        std::vector<std::vector<int>> apart(cells.crowded.size());
        const auto& crowded = cells.crowded;
        for (std::size_t i = 0; i < some.size(); ++i)
            if (is_crowded(cell[i]))
                apart[std::lower_bound(crowded.begin(), crowded.end(), cell[i]) - crowded.begin()].push_back(some[i]);
            else
                cells.sorted[next[cell[i]]++] = some[i];
        for (const std::vector<int>& own : apart) cells.within.push_back(cut(own));
        return cells;
    }

    void find_in(const Cells& cells, const double* low, const double* high, std::vector<std::int64_t>& found) const {
        int first[2] = {}, last[2] = {};
        for (int i = 0; i < used_; ++i) first[i] = cells.place(i, low[along_[i]]), last[i] = cells.place(i, high[along_[i]]);
        for (int x = first[0]; x <= last[0]; ++x) {
            const int from = x * cells.count[1] + first[1], to = x * cells.count[1] + last[1];
            for (int s = cells.starts[from]; s < cells.starts[to + 1]; ++s)
                if (holds(low, high, at(cells.sorted[s]))) found.push_back(cells.sorted[s]);
            auto crowd = std::lower_bound(cells.crowded.begin(), cells.crowded.end(), from);
            for (; crowd != cells.crowded.end() && *crowd <= to; ++crowd)
                find_in(cells.within[crowd - cells.crowded.begin()], low, high, found);
        }
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
