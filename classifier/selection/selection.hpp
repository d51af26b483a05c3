#pragma once
// Which features tell two fabrics apart (section III-D of Khan et al. 2016), and the principal
// components that section IV-B compares with.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/base/student_t.hpp"

namespace weft::classifier {

// Principal components of one core's scaled training rows.

struct PcaBasis {
  Matrix axes;  ///< [components x features], orthonormal rows, largest variance first
  std::vector<double> explained;  ///< cumulative share of the variance, one per component
};

/// Components of `rows` [n x features], which must have zero column means. At most `cap`
/// components; directions below 1e-7 of the largest deviation are dropped as rounding. The sign of
/// an axis is fixed by its largest entry being positive. No variance at all gives one axis of
/// zeros.
PcaBasis pca_basis(const Matrix& rows, std::size_t cap);

/// The fewest components that explain at least `share` of the variance; at least one, at most all.
std::size_t components_for(const PcaBasis& basis, double share);

/// Two-sample t statistic with pooled variance of every column, of the rows `which`; those with
/// sign[i] > 0 against the others, `sign` has one entry per row of the matrix. Each side needs a
/// row, both together three (otherwise every t is 0). Columns are compared at their own scale, so
/// nothing overflows. The pooled deviation is kept above 1e-9 of the larger mean (AMB-13): equal up
/// to rounding means t = 0.
std::vector<double> t_statistics(const Matrix& rows, std::span<const std::size_t> which,
                                 std::span<const int> sign);

/// Welch's test of every column: the variances of the two sides are not taken for equal.
struct WelchTest {
  std::vector<double> t;
  std::vector<double> df;     ///< Welch-Satterthwaite; from the smaller side's n - 1 to n + m - 2
  std::vector<double> log_p;  ///< natural logarithm of the two-sided p
};

/// Rows with sign[i] > 0 against the others, of the rows `which`; `sign` has one entry per row of
/// the matrix (Welch 1947). The pooled test's t and degrees of freedom where a side has a single
/// row, and so no variance, and where both variances are rounding only (AMB-13); with fewer than
/// three rows every t is 0 and every p is 1.
WelchTest welch_statistics(const Matrix& rows, std::span<const std::size_t> which,
                           std::span<const int> sign);

/// The first `most` columns by falling |t|; equal ones by column number. |t| and not p: p
/// underflows. Where degrees of freedom differ, log p in place of t: the largest |log p| is the
/// least likely.
std::vector<std::size_t> rank_by_t(std::span<const double> t,
                                   std::size_t most = static_cast<std::size_t>(-1));

/// How many of the ranked columns to keep: those with p < delta, at most `cap`, at least one
/// (AMB-14).
std::size_t subset_size(std::span<const double> t, std::span<const std::size_t> ranked, double df,
                        double delta, std::size_t cap, const RareT& rare = RareT());

/// The same where degrees of freedom differ from column to column: `ranked` by rising log p.
std::size_t subset_size(std::span<const double> log_p, std::span<const std::size_t> ranked,
                        double delta, std::size_t cap);

}  // namespace weft::classifier
