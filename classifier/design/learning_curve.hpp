#pragma once
// How accuracy grows with the repetitions of a campaign, and what more of them would give.
// docs/design.md, "How many repetitions are enough".

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learner.hpp"

namespace weft::classifier::design {

// How an error falls with the training: error(m) = floor + scale m^-exponent (Cortes and others
// 1994; Figueroa and others 2012, who weight the points).

struct PowerLaw {
  double floor = 0;  ///< what no training removes, 0 to 1
  double scale = 0;  ///< >= 0
  double exponent = 1;
  [[nodiscard]] double error_at(double trained) const;  ///< within 0 to 1
};

/// A measured error and its weight, 1 / variance.
struct ErrorPoint {
  double trained = 1;  ///< repetitions, positive
  double error = 0;
  double weight = 1;
};

/// The weighted least-squares law of this exponent, floor and scale not negative; in closed form.
PowerLaw fit_power_law(std::span<const ErrorPoint> points, double exponent);
/// Sum of weight (error - law)^2.
double misfit(std::span<const ErrorPoint> points, const PowerLaw& law);

/// Exponents that are tried: 0.25 to 2, from learning that hardly ends to one that soon has.
const std::vector<double>& exponents();
/// The best of those.
PowerLaw fit_power_law(std::span<const ErrorPoint> points);

struct CurveOptions {
  Learner learner = Learner::pvalue;
  /// Random choices of the repetitions that train, for each repetition left out.
  std::size_t draws = 4;
  std::size_t most_points = 8;  ///< of a longer campaign: sizes in equal ratios
  std::uint64_t seed = 1;
  std::size_t threads = 0;
  std::function<bool()> stop = {};
};

/// Accuracy of leave-one-repetition-out in campaigns of so many repetitions.
struct CurvePoint {
  std::size_t repetitions = 0;          ///< one of them tests, the others train
  double accuracy = 0;                  ///< mean over all trials and draws
  Interval ci95;                        ///< see clustered_interval(): a repetition is a cluster
  std::vector<double> error_by_tested;  ///< [repetitions of the data] mean over the draws
};

struct LearningCurve {
  std::vector<CurvePoint> points;  ///< by rising number; the last is of the whole campaign
  std::size_t repetitions = 0;     ///< of the data
  std::size_t fabrics = 0;
  std::size_t trials = 0;
  std::size_t draws = 0;  ///< CurveOptions::draws
};

/// Groups are repetitions. Each is left out in turn and asked about by learners that were trained
/// on 2, 3, ... of the others. Refuses fewer than 4 groups, fewer than two labels, and what the
/// learner refuses; a fabric that a group lacks is left out there.
Result<LearningCurve> learning_curve(const FeatureMatrix& matrix, const CurveOptions& options);

struct ForecastOptions {
  std::size_t predict = 20;  ///< repetitions
  double accuracy = 0.9;     ///< that is wanted
  std::size_t most = 200;    ///< repetitions that are looked for
  std::size_t resamples = 2000;
  std::uint64_t seed = 1;
};

struct RepetitionForecast {
  PowerLaw law;  ///< best fit to all points
  std::size_t predict = 0;
  /// The accuracy that leave-one-repetition-out of a campaign of `predict` repetitions measures.
  double accuracy = 0;  ///< median
  Interval ci95;        ///< prediction interval: the noise of that measurement is part of it
  double wanted = 0;
  std::size_t most = 0;                    ///< repetitions that were looked at
  std::optional<std::size_t> enough;       ///< median of what reaches `wanted`; none: not reached
  std::optional<std::size_t> enough_low;   ///< 2.5 % of the resamples reach it by then
  std::optional<std::size_t> enough_high;  ///< 97.5 %
  double reached_share = 0;                ///< of the resamples, within `most` repetitions
};

/// Resamples repetitions with replacement, the whole curve of each at once; to each resampled curve
/// a power law is fitted whose exponent is drawn from exponents() by how well it fits. Needs two
/// points at least.
Result<RepetitionForecast> forecast_repetitions(const LearningCurve& curve,
                                                const ForecastOptions& options);

}  // namespace weft::classifier::design
