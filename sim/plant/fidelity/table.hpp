#pragma once
// Measured speed and accuracy of simulation settings (sim/fidelity.json, made by `weft trade sim
// --table`): errors of recorded trials at many settings, and the cost of a run.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sim/plant/fidelity/setting.hpp"

namespace weft::sim {

inline constexpr int fidelity_table_version = 3;

/// Largest errors of the normal force [N], over the recorded samples of S, P, M and E of a trial,
/// as quantiles over the trials.
struct ClothError {
  std::string fabric;
  std::size_t runs = 0;  ///< trials
  double q50_n = 0, q99_n = 0, max_n = 0;
};

/// Factor on the largest measured error, which gives the promise of a setting.
struct Margin {
  double factor = 1;
  double held_share = 0;  ///< share of held-out runs within it; 0: unknown
};

struct MeasuredSetting {
  FidelitySetting setting;
  double contact_us_per_s = 0;  ///< processor time per bench second, on the table's machine
  std::vector<ClothError> cloths;
  Margin margin = {};
  /// Over all fabrics, as shares of impact_scale_n(): for a fabric without a row.
  double any_q99 = 0, any_max = 0;
  Margin any_margin = {};
};

struct MeasuredRange {
  double least = 0, most = 0;
  [[nodiscard]] bool contains(double value) const { return value >= least && value <= most; }
};

/// Conditions of the measurement of the errors.
struct TableConditions {
  std::size_t scenes = 0, seeds = 0;
  std::size_t trials = 0;        ///< complete trials of scenes x seeds; only these count
  std::uint64_t space_seed = 0;  ///< seed of the drawn scenes
  std::string reference;
  double share = 0.99;  ///< share of runs for which a promise is kept
  MeasuredRange force_n, speed_mps, seat_speed_mps, press_s, mount_stiffness_n_m, slack_m;
};

/// Processor time in addition to the contact's [us per bench second], on the table's machine. All
/// costs and the probe are processor time: a forecast is for a machine without other load. The
/// evaluation is that of a campaign of 17 fabrics and 6 repetitions.
struct HostCost {
  double pads_us_per_s = 0, emulators_us_per_s = 0, drivers_us_per_s = 0, recorder_us_per_s = 0;
  double export_us_per_trial = 0, evaluate_us_per_trial = 0;
  double quick_check_us_per_s = 0, full_check_us_per_s = 0;  ///< per checked bench second
  double probe_us = 0;  ///< result of measure_probe_us() on that machine
};

struct FidelityTable {
  std::string made_by, commit, machine, compiler, fabrics_sha256;
  int rules = 0;  ///< engine_rules of the runs
  TableConditions conditions;
  std::vector<MeasuredSetting> settings;
  HostCost host_cost;
};

/// All data of the table are from a simulated bench. Errors: parse, range, with a JSON pointer;
/// unsupported, for a table of an earlier version and for a margin that was not verified for its
/// share of runs.
Result<FidelityTable> parse_fidelity(std::string_view json);
/// The text of the file.
std::string to_json(const FidelityTable& table);

}  // namespace weft::sim
