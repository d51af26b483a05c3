#pragma once
// Which features tell two fabrics apart: section III-D of Khan et al. 2016.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/features/matrix.hpp"
#include "classifier/selection/student_t.hpp"

namespace weft::classifier {

/// Two-sample t statistic with pooled variance of every column; rows with sign[i] > 0 against the
/// others. Each side needs a row, both together three (otherwise every t is 0). Columns are
/// compared at their own scale, so nothing overflows. The pooled deviation is kept above 1e-9 of
/// the larger mean (AMB-13): equal up to rounding means t = 0.
std::vector<double> t_statistics(const Matrix& rows, std::span<const int> sign);
/// The same of the rows `which`; `sign` has one entry per row of the matrix.
std::vector<double> t_statistics(const Matrix& rows, std::span<const std::size_t> which,
                                 std::span<const int> sign);

/// The first `most` columns by falling |t|; equal ones by column number. |t| and not p: p
/// underflows.
std::vector<std::size_t> rank_by_t(std::span<const double> t,
                                   std::size_t most = static_cast<std::size_t>(-1));

/// How many of the ranked columns to keep: those with p < delta, at most `cap`, at least one
/// (AMB-14).
std::size_t subset_size(std::span<const double> t, std::span<const std::size_t> ranked, double df,
                        double delta, std::size_t cap, const RareT& rare = RareT());

}  // namespace weft::classifier
