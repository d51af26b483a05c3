#pragma once
// How accuracy grows with the repetitions of a campaign, and the forecast for more repetitions.
// docs/explanation/campaign-design.md, "Forecast".

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

// Decrease of the error with the training repetitions m: error(m) = floor + scale m^-exponent
// (Cortes and others 1994; Figueroa and others 2012, who weight the points).

struct PowerLaw {
  double floor = 0;  ///< error that no training removes, 0 to 1
  double scale = 0;  ///< >= 0
  double exponent = 1;
  [[nodiscard]] double error_at(double trained) const;  ///< clamped to 0 to 1
};

/// A measured error and its weight, 1 / variance.
struct ErrorPoint {
  double trained = 1;  ///< repetitions, positive
  double error = 0;
  double weight = 1;
};

/// The weighted least-squares law with this exponent, in closed form; floor and scale are not
/// negative.
PowerLaw fit_power_law(std::span<const ErrorPoint> points, double exponent);
/// Sum of weight (error - law)^2.
double misfit(std::span<const ErrorPoint> points, const PowerLaw& law);

/// Exponents to try: 0.25 (slow learning) to 2 (fast learning).
const std::vector<double>& exponents();
/// The law with the best of those exponents.
PowerLaw fit_power_law(std::span<const ErrorPoint> points);

struct CurveOptions {
  Learner learner = Learner::pvalue;
  /// Random choices of the training repetitions, for each repetition left out.
  std::size_t draws = 4;
  std::size_t most_points = 8;  ///< most points of a longer campaign; their sizes have equal ratios
  std::uint64_t seed = 1;
  std::size_t threads = 0;
  std::function<bool()> stop = {};
};

/// Accuracy of leave-one-repetition-out in campaigns of `repetitions` repetitions.
struct CurvePoint {
  std::size_t repetitions = 0;          ///< one of them tests, the others train
  double accuracy = 0;                  ///< mean over all trials and draws
  Interval ci95;                        ///< see clustered_interval(): a repetition is a cluster
  std::vector<double> error_by_tested;  ///< [repetitions of the data] mean over the draws
};

struct LearningCurve {
  std::vector<CurvePoint>
      points;  ///< by rising number of repetitions; the last point is the whole campaign
  std::size_t repetitions = 0;  ///< number in the data
  std::size_t fabrics = 0;
  std::size_t trials = 0;
  std::size_t draws = 0;  ///< CurveOptions::draws
};

/// Learning curve with groups as repetitions. Each group is left out once and predicted by learners
/// trained on 2, 3, ... of the others. Refuses fewer than 4 groups, fewer than two labels, and the
/// errors of the learner. If a group lacks a fabric, that fabric is left out there.
Result<LearningCurve> learning_curve(const FeatureMatrix& matrix, const CurveOptions& options);

struct ForecastOptions {
  std::size_t predict = 20;  ///< number of repetitions to forecast for
  double accuracy = 0.9;     ///< target accuracy, 0 to 1
  std::size_t most = 200;    ///< largest number of repetitions to search
  std::size_t resamples = 2000;
  std::uint64_t seed = 1;
};

struct RepetitionForecast {
  PowerLaw law;  ///< best fit to all points
  std::size_t predict = 0;
  /// The forecast accuracy of leave-one-repetition-out in a campaign of `predict` repetitions.
  double accuracy = 0;  ///< median
  Interval ci95;        ///< prediction interval; it includes the noise of that measurement
  double wanted = 0;
  std::size_t most = 0;               ///< largest number of repetitions searched
  std::optional<std::size_t> enough;  ///< median number that reaches `wanted`; none: not reached
  std::optional<std::size_t>
      enough_low;  ///< 2.5 % of the resamples reach `wanted` with this number
  std::optional<std::size_t>
      enough_high;  ///< 97.5 % of the resamples reach `wanted` with this number
  double reached_share =
      0;  ///< share of the resamples that reach `wanted` within `most` repetitions
};

/// Resamples repetitions with replacement, each with its whole curve. Each resampled curve gets a
/// power law, with an exponent drawn from exponents() by its likelihood. Needs at least two points.
Result<RepetitionForecast> forecast_repetitions(const LearningCurve& curve,
                                                const ForecastOptions& options);

}  // namespace weft::classifier::design
