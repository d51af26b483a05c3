#include "daemon/analysis/calibration/identifiability.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace weft::daemon::calibration {
namespace {

constexpr double difference_step = 0.02;  // as a share of the bounds' width, to both sides
constexpr double blind_share = 0.01;      // as a share of the largest singular value
constexpr double named_weight = 0.3;      // smallest weight that is named, in a direction of length
                                          // 1
constexpr double chi_square_95 = 3.84;    // one degree of freedom
constexpr std::size_t profile_steps = 3;  // after the bound's own value
constexpr std::size_t most_directions = 12;

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

Vector vector_of(const std::vector<double>& values) {
  return Eigen::Map<const Vector>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// Evaluates the objective around one point, in units of the bounds' width.
class Around {
 public:
  Around(Objective& objective, const ClothModel& model, const std::vector<double>& values)
      : objective_(&objective), model_(&model), values_(values) {}

  Status prepare(const std::vector<std::size_t>& varied) {
    const auto here = objective_->residuals_at(values_);
    if (!here) return pass(here.error());
    least_ = sum_of_squares(*here);
    jacobian_.resize(static_cast<Eigen::Index>(here->size()),
                     static_cast<Eigen::Index>(varied.size()));
    varied_ = varied;
    for (std::size_t k = 0; k < varied.size(); ++k)
      if (Status ok = fill_column(k); !ok) return ok;
    return {};
  }
  [[nodiscard]] double least() const { return least_; }
  [[nodiscard]] const Matrix& jacobian() const { return jacobian_; }
  [[nodiscard]] double unit(std::size_t parameter) const {
    return model_->parameters()[parameter].to_unit(values_[parameter]);
  }

  /// Rise of Q above its minimum with one parameter at `unit_there`. The others of its block are
  /// unchanged or compensated, whichever gives the lower Q.
  Result<double> rise(std::size_t parameter, double unit_there) {
    std::vector<double> there = values_;
    there[parameter] = model_->parameters()[parameter].from_unit(unit_there);
    const auto unmoved = objective_->cost_at(there);
    if (!unmoved) return unmoved;
    compensate(parameter, unit_there - unit(parameter), there);
    const auto moved = objective_->cost_at(there);
    if (!moved) return moved;
    return std::max(0.0, std::min(*unmoved, *moved) - least_);
  }

 private:
  Status fill_column(std::size_t k) {
    const std::size_t parameter = varied_[k];
    const double low = std::max(0.0, unit(parameter) - difference_step),
                 high = std::min(1.0, unit(parameter) + difference_step);
    std::array<Vector, 2> ends;
    for (std::size_t side = 0; side < 2; ++side) {
      std::vector<double> there = values_;
      there[parameter] = model_->parameters()[parameter].from_unit(side == 0 ? low : high);
      const auto out = objective_->residuals_at(there);
      if (!out) return pass(out.error());
      ends[side] = vector_of(*out);
    }
    jacobian_.col(static_cast<Eigen::Index>(k)) = (ends[1] - ends[0]) / (high - low);
    return {};
  }

  /// Applies the Gauss-Newton step of the other parameters of the block.
  void compensate(std::size_t parameter, double moved, std::vector<double>& values) const {
    const Parameter& one = model_->parameters()[parameter];
    std::vector<Eigen::Index> others;
    Eigen::Index own = 0;
    for (std::size_t k = 0; k < varied_.size(); ++k) {
      const Parameter& other = model_->parameters()[varied_[k]];
      if (varied_[k] == parameter)
        own = static_cast<Eigen::Index>(k);
      else if (other.block == one.block && other.cloth == one.cloth)
        others.push_back(static_cast<Eigen::Index>(k));
    }
    if (others.empty()) return;
    const Matrix rest = jacobian_(Eigen::all, others);
    const Vector step = rest.completeOrthogonalDecomposition().solve(-moved * jacobian_.col(own));
    for (std::size_t k = 0; k < others.size(); ++k) {
      const std::size_t at = varied_[static_cast<std::size_t>(others[k])];
      values[at] =
          model_->parameters()[at].from_unit(unit(at) + step(static_cast<Eigen::Index>(k)));
    }
  }

  Objective* objective_;
  const ClothModel* model_;
  std::vector<double> values_;
  std::vector<std::size_t> varied_;
  Matrix jacobian_;
  double least_ = 0;
};

/// The first crossing of the threshold between the minimum and `bound`; nothing if there is none.
Result<std::optional<double>> find_crossing(Around& around, std::size_t parameter, double bound,
                                            double threshold) {
  const double from = around.unit(parameter);
  if (std::abs(bound - from) < difference_step) return std::optional<double>();
  const auto at_bound = around.rise(parameter, bound);
  if (!at_bound) return pass(at_bound.error());
  if (!(*at_bound > threshold)) return std::optional<double>();
  double inner = from, outer = bound, inner_root = 0, outer_root = std::sqrt(*at_bound);
  for (std::size_t i = 0; i < profile_steps; ++i) {
    // The square root of a parabola is linear.
    const double share = (std::sqrt(threshold) - inner_root) / (outer_root - inner_root);
    const double there = inner + std::clamp(share, 0.1, 0.9) * (outer - inner);
    const auto rise = around.rise(parameter, there);
    if (!rise) return pass(rise.error());
    const bool outside = *rise > threshold;
    (outside ? outer : inner) = there;
    (outside ? outer_root : inner_root) = std::sqrt(*rise);
  }
  return std::optional<double>(outer);
}

Result<ParameterInterval> find_interval(Around& around, const Parameter& parameter,
                                        std::size_t number, double threshold) {
  const auto low = find_crossing(around, number, 0, threshold);
  if (!low) return pass(low.error());
  const auto high = find_crossing(around, number, 1, threshold);
  if (!high) return pass(high.error());
  const int closed = (low->has_value() ? 1 : 0) + (high->has_value() ? 1 : 0);
  return ParameterInterval{closed == 2   ? Standing::calibrated
                           : closed == 1 ? Standing::bounded
                                         : Standing::not_seen,
                           *low                      ? parameter.from_unit(**low)
                           : parameter.is_off_at_low ? 0
                                                     : parameter.low,
                           *high ? parameter.from_unit(**high) : parameter.high};
}

std::string direction_text(const Vector& direction, const std::vector<std::size_t>& varied,
                           const ClothModel& model) {
  std::vector<std::string> names;
  for (Eigen::Index k = 0; k < direction.size(); ++k)
    if (std::abs(direction(k)) >= named_weight)
      names.push_back(model.parameters()[varied[static_cast<std::size_t>(k)]].label());
  if (names.empty()) return {};
  if (names.size() == 1) return names.front() + ": no effect on the recordings.";
  std::string out = names.front();
  for (std::size_t i = 1; i < names.size(); ++i)
    out += (i + 1 == names.size() ? " and " : ", ") + names[i];
  return out + ": only their combination is determined, not each one.";
}

std::vector<std::string> find_blind(const Matrix& jacobian, const std::vector<std::size_t>& varied,
                                    const ClothModel& model) {
  const Eigen::JacobiSVD<Matrix> svd(jacobian, Eigen::ComputeFullV);
  std::vector<std::string> out;
  const auto& values = svd.singularValues();
  for (Eigen::Index k = jacobian.cols() - 1; k >= 0 && out.size() < most_directions; --k) {
    const bool is_blind = k >= values.size() || values(k) < blind_share * values(0);
    if (!is_blind) break;
    if (std::string text = direction_text(svd.matrixV().col(k), varied, model); !text.empty())
      out.push_back(std::move(text));
  }
  return out;
}

}  // namespace

std::string_view to_string(Standing standing) {
  static constexpr std::array<std::string_view, 4> names{"estimated", "calibrated", "bounded",
                                                         "not_seen"};
  return names[static_cast<std::size_t>(standing)];
}

Result<Identifiability> identify(Objective& objective, const ClothModel& model,
                                 const std::vector<double>& values,
                                 const std::vector<std::size_t>& searched) {
  std::vector<std::size_t> varied = searched;
  for (const std::size_t fixed : model.block(Block::fixed)) varied.push_back(fixed);
  Around around(objective, model, values);
  if (Status ok = around.prepare(varied); !ok) return pass(ok.error());
  Identifiability out;
  const double freedom =
      static_cast<double>(objective.targets().size()) - static_cast<double>(searched.size());
  out.threshold = chi_square_95 * std::max(1.0, around.least() / std::max(1.0, freedom));
  out.blind_directions = find_blind(around.jacobian(), varied, model);
  for (std::size_t i = 0; i < model.parameters().size(); ++i)
    out.intervals.push_back({Standing::estimated, values[i], values[i]});
  for (const std::size_t i : searched) {
    const auto interval = find_interval(around, model.parameters()[i], i, out.threshold);
    if (!interval) return pass(interval.error());
    out.intervals[i] = *interval;
  }
  return out;
}

}  // namespace weft::daemon::calibration
