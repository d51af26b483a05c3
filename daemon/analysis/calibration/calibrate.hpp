#pragma once
// `weft sim calibrate`: fits the plant's fabrics and pads to recordings and reports what the
// recordings do not determine. It compares statistics of signals; no accuracy and no classifier is
// used.
//
// Order: A, estimators: noise law and spread of gains. B, the parameters of each fabric. C, the
// common parameters of all fabrics; then the noise added by the fitted texture is subtracted. Then
// B and C again in turn. Then intervals (identifiability.hpp), rounding, and the held-out check.
// Recorded statistics use all fitted strokes; only a selection of them is simulated
// (stroke_choice.hpp).

#include <functional>
#include <optional>

#include "daemon/analysis/calibration/identifiability.hpp"
#include "sim/plant/fabric.hpp"

namespace weft::daemon::calibration {

/// All limits are counts, so that load and machine do not change the result.
struct CalibrationOptions {
  std::uint64_t seed = 1;
  std::size_t threads = 2;              ///< does not change the result
  std::size_t windows = 144;            ///< simulated per evaluation (choose_strokes())
  std::size_t starts = 5;               ///< starting points of a block's search
  std::size_t evaluations = 25;         ///< per starting point
  std::size_t common_evaluations = 60;  ///< the same, for the common parameters
  std::size_t rounds = 2;               ///< repetitions of all blocks
  std::size_t bootstrap_draws = 400;
  std::size_t replicates = 8;  ///< simulated sets, for the spread over seeds
  std::size_t held_out_replicates = 40;
};

struct CalibratedParameter {
  Parameter parameter;
  Standing standing = Standing::estimated;
  double value = 0, low = 0, high = 0;  ///< natural scale, rounded to a tenth of the interval
  /// False: `low` and `high` equal the value and have no meaning.
  [[nodiscard]] bool has_interval() const { return low < high; }
};

/// One compared statistic: recorded, and simulated with the initial estimates and with the result.
struct ComparedStatistic {
  Statistic real;
  double low = 0, high = 0;  ///< 95 % interval of the recorded one, on its scale; equal: not known
  std::optional<double> before, after;  ///< on its scale; none: missing from the simulated
                                        ///< selection
  bool is_fitted = false;
  [[nodiscard]] bool has_interval() const { return low < high; }
};

struct HeldOutStatistic {
  Statistic real;
  /// 95 % interval of simulated values, on its scale; equal: too few simulated sets have it.
  double low = 0, high = 0;
  bool is_inside = false;
};
struct HeldOutCheck {
  std::vector<HeldOutStatistic> statistics;  ///< empty: not checked
  std::size_t inside = 0;
  std::string why_not;  ///< reason if not checked, a sentence
  [[nodiscard]] bool is_checked() const { return !statistics.empty(); }
  /// True if at least 80 % are inside. An unchecked result does not pass.
  [[nodiscard]] bool passes() const;
};

struct CalibrationResult {
  std::vector<BaseCloth> cloths;
  std::vector<CalibratedParameter> parameters;
  std::vector<ComparedStatistic> statistics;
  std::vector<std::string> blind_directions, remarks;  ///< one sentence each
  HeldOutCheck held_out;
  double cost_before = 0, cost_after = 0;
  std::size_t targets = 0, evaluations = 0;
  double scale = 1;  ///< counts of the recorded sensor per count of the plant's
  std::uint64_t seed = 0;
  std::size_t fitted_strokes = 0, simulated_strokes = 0, held_out_strokes = 0;
  RecordingView real, before, after;  ///< the simulated selection, for pictures
};

using CalibrationProgress = std::function<void(const std::string& what)>;

/// `held_out` empty: no check. Its fabrics without a fitted stroke on the fabric are left out with
/// a remark. Errors: unsupported (without NLopt; more channels than the plant has);
/// invalid_argument (more fabrics than windows; labels that differ in case only; a held-out fabric
/// that `fitted` lacks, or another number of channels); measurement (no stroke on the fabric; no
/// statistic that a parameter can change); those of ClothModel::make().
Result<CalibrationResult> calibrate(const RecordingView& fitted,
                                    const std::optional<RecordingView>& held_out,
                                    const sim::FabricLibrary& library,
                                    const CalibrationOptions& options,
                                    const CalibrationProgress& progress = {});

/// Rounds to the power of ten at or below a tenth of the interval, and of the value. So two digits
/// remain of a value that is small compared with its interval. The result does not depend on the
/// compiler.
double round_to_interval(double value, double low, double high);

}  // namespace weft::daemon::calibration
