#pragma once
// Which of several cells is taken: separability first, then time, then how well the taxels answer.
// docs/design.md, "Which cell".

#include <cstddef>
#include <span>
#include <vector>

namespace weft::classifier::design {

/// What the rule knows of a cell.
struct CellStatistics {
  double accuracy = 0;       ///< share of the trials told right
  double seconds = 0;        ///< median per trial, less is better
  double seconds_error = 0;  ///< standard error of that median
  double snr_db = 0;         ///< mean, more is better
};

/// Times that differ by less than this share of the shorter one are equal: what is on record is
/// about half of what a trial takes, so a campaign would not notice.
inline constexpr double equal_seconds_share = 0.05;

/// Seconds within which two cells take equally long: `equal_seconds_share` of the shorter time, or
/// what the difference of their medians varies by (95 %), whichever is more.
double seconds_tolerance(const CellStatistics& a, const CellStatistics& b);
bool is_cheaper(const CellStatistics& a, const CellStatistics& b);

/// Of an accuracy among so many answers; 0 and 1 count as if half an answer more were the other
/// way.
double standard_error(double accuracy, double requested);

/// Of the cells whose accuracy is at most one standard error below the best (Breiman and others
/// 1984), those that take no longer than the quickest of them; of these the one with the largest
/// signal over noise. `requested`: effective answers of a cell. At least one cell.
std::size_t take(std::span<const CellStatistics> cells, double requested);

/// Cells that no other one beats, in the order of their time: another one beats a cell when it is
/// more accurate and takes no longer, or is as accurate and takes less.
std::vector<std::size_t> find_front(std::span<const CellStatistics> cells);

}  // namespace weft::classifier::design
