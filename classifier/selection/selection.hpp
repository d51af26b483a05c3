#pragma once
// Selects the features that separate two fabrics (section III-D of Khan et al. 2016), and computes
// the principal components for the comparison of section IV-B.

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

/// Components of `rows` [n x features]; the column means must be zero. At most `cap` components;
/// directions below 1e-7 of the largest deviation are dropped as rounding. The largest entry of an
/// axis is positive, which fixes its sign. Without variance the result is one axis of zeros.
PcaBasis pca_basis(const Matrix& rows, std::size_t cap);

/// The fewest components that explain at least `share` of the variance; at least one.
std::size_t components_for(const PcaBasis& basis, double share);

/// Two-sample t statistic with pooled variance of every column, over the rows `which`. Compares
/// rows with sign[i] > 0 to the others; `sign` has one entry per row of the matrix. Each side needs
/// a row, both together three (otherwise every t is 0). Each column has its own scale, so nothing
/// overflows. The pooled deviation is at least 1e-9 of the larger mean (AMB-13): means that are
/// equal up to rounding give t = 0.
std::vector<double> t_statistics(const Matrix& rows, std::span<const std::size_t> which,
                                 std::span<const int> sign);

/// Welch's test of every column; it does not assume equal variances of the two sides.
struct WelchTest {
  std::vector<double> t;
  std::vector<double> df;     ///< Welch-Satterthwaite; from the smaller side's n - 1 to n + m - 2
  std::vector<double> log_p;  ///< natural logarithm of the two-sided p
};

/// Compares rows with sign[i] > 0 to the others, over the rows `which`; `sign` has one entry per
/// row of the matrix (Welch 1947). Uses t and degrees of freedom of the pooled test if a side has a
/// single row, and so no variance, or if both variances are only rounding (AMB-13). With fewer than
/// three rows every t is 0 and every p is 1.
WelchTest welch_statistics(const Matrix& rows, std::span<const std::size_t> which,
                           std::span<const int> sign);

/// The first `most` columns by falling |t|; equal ones by column number. |t| is used because p
/// underflows. If degrees of freedom differ, pass log p instead of t: the largest |log p| is the
/// least likely.
std::vector<std::size_t> rank_by_t(std::span<const double> t,
                                   std::size_t most = static_cast<std::size_t>(-1));

/// Number of ranked columns to keep: those with p < delta, at most `cap`, at least one (AMB-14).
std::size_t subset_size(std::span<const double> t, std::span<const std::size_t> ranked, double df,
                        double delta, std::size_t cap, const RareT& rare = RareT());

/// The same if degrees of freedom differ between columns: `ranked` by rising log p.
std::size_t subset_size(std::span<const double> log_p, std::span<const std::size_t> ranked,
                        double delta, std::size_t cap);

}  // namespace weft::classifier
