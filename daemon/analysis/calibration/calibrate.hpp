#pragma once
// `weft sim calibrate`: fits the plant's cloths and pads to recordings and says what they do not
// show. It compares statistics of signals; no accuracy and no classifier has a part in it.
//
// Order: A, by estimators: noise law and spread of gains. B, each cloth's own parameters. C, those
// of all cloths; then what the fitted texture adds to the noise is taken off. Then B and C in turn
// again. Then intervals (identifiability.hpp), rounding, and the held-out check.
// The recorded statistics are those of all fitted strokes; simulated is a choice of them
// (stroke_choice.hpp).

#include <functional>
#include <optional>

#include "daemon/analysis/calibration/identifiability.hpp"
#include "sim/plant/fabric.hpp"

namespace weft::daemon::calibration {

/// Every limit is a count, so that load and machine change nothing.
struct CalibrationOptions {
  std::uint64_t seed = 1;
  std::size_t threads = 2;              ///< changes no result
  std::size_t windows = 144;            ///< simulated in one evaluation (choose_strokes())
  std::size_t starts = 5;               ///< of a block's search
  std::size_t evaluations = 25;         ///< from each start
  std::size_t common_evaluations = 60;  ///< the same, of what all cloths share
  std::size_t rounds = 2;               ///< of all blocks again
  std::size_t bootstrap_draws = 400;
  std::size_t replicates = 8;  ///< simulated, for the spread over seeds
  std::size_t held_out_replicates = 40;
};

struct CalibratedParameter {
  Parameter parameter;
  Standing standing = Standing::estimated;
  double value = 0, low = 0, high = 0;  ///< natural scale, rounded to a tenth of the interval
  /// No: `low` and `high` are the value, and say nothing.
  [[nodiscard]] bool has_interval() const { return low < high; }
};

/// One statistic of all that is fitted: recorded, and simulated with estimates and with the result.
struct ComparedStatistic {
  Statistic real;
  double low = 0, high = 0;  ///< 95 % interval of the recorded one, on its scale; equal: not known
  std::optional<double> before, after;  ///< on its scale; none: the simulated choice lacks it
  bool is_fitted = false;
  [[nodiscard]] bool has_interval() const { return low < high; }
};

struct HeldOutStatistic {
  Statistic real;
  /// Where 95 % of simulated ones lie, on its scale; equal: too few simulated sets have it.
  double low = 0, high = 0;
  bool is_inside = false;
};
struct HeldOutCheck {
  std::vector<HeldOutStatistic> statistics;  ///< none: not checked
  std::size_t inside = 0;
  std::string why_not;  ///< not checked: a sentence
  [[nodiscard]] bool is_checked() const { return !statistics.empty(); }
  /// At least 80 % lie inside. What was not checked has not passed.
  [[nodiscard]] bool passes() const;
};

struct CalibrationResult {
  std::vector<BaseCloth> cloths;
  std::vector<CalibratedParameter> parameters;
  std::vector<ComparedStatistic> statistics;
  std::vector<std::string> blind_directions, remarks;  ///< a sentence each
  HeldOutCheck held_out;
  double cost_before = 0, cost_after = 0;
  std::size_t targets = 0, evaluations = 0;
  double scale = 1;  ///< counts of the recorded sensor per count of the plant's
  std::uint64_t seed = 0;
  std::size_t fitted_strokes = 0, simulated_strokes = 0, held_out_strokes = 0;
  RecordingView real, before, after;  ///< the simulated choice, for pictures
};

using CalibrationProgress = std::function<void(const std::string& what)>;

/// `held_out`: nothing: no check. Its cloths whose fitted strokes are all off the cloth are left
/// out with a remark. Errors: unsupported (without NLopt; more channels than the plant's),
/// invalid_argument (more cloths than windows; labels that differ in case alone; a held-out cloth
/// that `fitted` does not have, or another number of channels), measurement (no stroke on the
/// cloth; no statistic that a parameter could move), those of ClothModel::make().
Result<CalibrationResult> calibrate(const RecordingView& fitted,
                                    const std::optional<RecordingView>& held_out,
                                    const sim::FabricLibrary& library,
                                    const CalibrationOptions& options,
                                    const CalibrationProgress& progress = {});

/// To the power of ten at or below a tenth of the interval, and of the value: two digits are left
/// of one that is small beside its interval. Compilers agree on what is left.
double round_to_interval(double value, double low, double high);

}  // namespace weft::daemon::calibration
