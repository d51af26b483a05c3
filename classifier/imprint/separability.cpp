#include "classifier/imprint/separability.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "classifier/imprint/linear_rule.hpp"

namespace weft::classifier::imprint {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double no_distance = 1e-7;
constexpr double least_product = 1e-10;  // of unit vectors: far above rounding
constexpr double least_weight = 1e-12;

// A row of unit length, once with every wrong class: +row in its own class's block of weights, -row
// in the wrong one's, divided by sqrt 2.
struct Corner {
  Index row;
  Index own, wrong;
};

class Hull {
 public:
  Hull(const Matrix& rows, std::span<const std::size_t> of_row, std::size_t classes)
      : rows_(static_cast<Index>(rows.rows()), static_cast<Index>(rows.cols())) {
    for (Index r = 0; r < rows_.rows(); ++r) {
      const auto from = rows.row(static_cast<std::size_t>(r));
      rows_.row(r) = Eigen::Map<const Eigen::RowVectorXd>(from.data(), rows_.cols()).normalized();
      const auto own = static_cast<Index>(of_row[static_cast<std::size_t>(r)]);
      for (Index wrong = 0; wrong < static_cast<Index>(classes); ++wrong)
        if (wrong != own) corners_.push_back({r, own, wrong});
    }
    products_ = rows_ * rows_.transpose();
    weight_ = MatrixXd::Zero(static_cast<Index>(classes), rows_.cols());
  }

  [[nodiscard]] double product(const Corner& a, const Corner& b) const {
    const double blocks = (a.own == b.own ? 1.0 : 0.0) - (a.own == b.wrong ? 1.0 : 0.0) -
                          (a.wrong == b.own ? 1.0 : 0.0) + (a.wrong == b.wrong ? 1.0 : 0.0);
    return 0.5 * blocks * products_(a.row, b.row);
  }

  /// The corner with the least product with the point, and that product.
  std::pair<std::size_t, double> least() {
    const MatrixXd scores = rows_ * weight_.transpose();
    std::pair<std::size_t, double> out{0, std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const Corner& c = corners_[i];
      const double value = (scores(c.row, c.own) - scores(c.row, c.wrong)) / std::sqrt(2.0);
      if (value < out.second) out = {i, value};
    }
    return out;
  }

  /// The point as a combination of corners.
  void place(const std::vector<std::size_t>& corral, const VectorXd& share) {
    weight_.setZero();
    for (std::size_t i = 0; i < corral.size(); ++i) {
      const Corner& c = corners_[corral[i]];
      const Eigen::RowVectorXd part =
          share(static_cast<Index>(i)) / std::sqrt(2.0) * rows_.row(c.row);
      weight_.row(c.own) += part;
      weight_.row(c.wrong) -= part;
    }
  }

  [[nodiscard]] double squared_length() const { return weight_.squaredNorm(); }
  [[nodiscard]] const std::vector<Corner>& corners() const { return corners_; }

 private:
  MatrixXd rows_, products_, weight_;
  std::vector<Corner> corners_;
};

// Shares, summing to 1, of the point nearest to the origin in the plane through the corral.
VectorXd nearest_in_plane(const Hull& hull, const std::vector<std::size_t>& corral) {
  const auto n = static_cast<Index>(corral.size());
  MatrixXd system(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j <= i; ++j)
      system(i, j) = system(j, i) =
          1.0 + hull.product(hull.corners()[corral[static_cast<std::size_t>(i)]],
                             hull.corners()[corral[static_cast<std::size_t>(j)]]);
  const VectorXd solution = system.ldlt().solve(VectorXd::Ones(n));
  return solution / solution.sum();
}

// Wolfe's minor cycle: towards the plane's nearest point until a share would turn negative; that
// corner is dropped.
void shrink(const Hull& hull, std::vector<std::size_t>& corral, VectorXd& share) {
  for (;;) {
    const VectorXd goal = nearest_in_plane(hull, corral);
    if (goal.minCoeff() > least_weight || corral.size() == 1) {
      share = goal;
      return;
    }
    double step = 1.0;
    for (Index i = 0; i < goal.size(); ++i)
      if (goal(i) <= least_weight && share(i) > goal(i))
        step = std::min(step, share(i) / (share(i) - goal(i)));
    share = (1.0 - step) * share + step * goal;
    std::vector<std::size_t> retained;
    std::vector<double> retained_share;
    for (Index i = 0; i < share.size(); ++i)
      if (share(i) > least_weight) {
        retained.push_back(corral[static_cast<std::size_t>(i)]);
        retained_share.push_back(share(i));
      }
    if (retained.size() == corral.size() || retained.empty())
      return;  // rounding: nothing left to drop
    corral = std::move(retained);
    share = Eigen::Map<const VectorXd>(retained_share.data(),
                                       static_cast<Index>(retained_share.size()));
    share /= share.sum();
  }
}

SeparabilityOutcome walk(Hull& hull, std::size_t most_steps) {
  std::vector<std::size_t> corral{0};
  VectorXd share = VectorXd::Ones(1);
  SeparabilityOutcome out;
  for (out.steps = 1; out.steps <= most_steps; ++out.steps) {
    hull.place(corral, share);
    const double length = std::sqrt(hull.squared_length());
    if (length <= no_distance) {
      out.verdict = Separability::not_separable;
      return out;
    }
    const auto [corner, product] = hull.least();
    if (product > least_product * length) {
      out.verdict = Separability::separable;
      out.margin = product / length;
      return out;
    }
    if (std::find(corral.begin(), corral.end(), corner) != corral.end()) return out;  // rounding
    corral.push_back(corner);
    share.conservativeResize(share.size() + 1);
    share(share.size() - 1) = 0.0;
    shrink(hull, corral, share);
  }
  return out;
}

}  // namespace

std::string_view to_string(Separability verdict) {
  switch (verdict) {
    case Separability::separable:
      return "separable";
    case Separability::not_separable:
      return "not separable";
    case Separability::undecided:
      break;
  }
  return "undecided";
}

Result<SeparabilityOutcome> separability(const Matrix& rows, std::span<const std::size_t> of_row,
                                         std::size_t classes, std::size_t most_steps) {
  if (auto ok = check_training(rows, of_row, classes); !ok) return pass(ok.error(), "separability");
  Hull hull(with_ones(scaled(fit_scaler(rows), rows)), of_row, classes);
  return walk(hull, most_steps);
}

}  // namespace weft::classifier::imprint
