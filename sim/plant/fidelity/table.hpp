#pragma once
// The measured trade between speed and accuracy (sim/fidelity.json, made by `weft trade sim
// --table`): errors of recorded trials at many settings, and what a run costs.

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

/// Times the largest measured error: what a setting promises.
struct Margin {
  double factor = 1;
  double held_share = 0;  ///< of runs that were held back, those within it; 0: not known
};

struct MeasuredSetting {
  FidelitySetting setting;
  double contact_us_per_s = 0;  ///< processor time of a bench second, on the table's machine
  std::vector<ClothError> cloths;
  Margin margin = {};
  /// Of all cloths, as shares of impact_scale_n(): for a cloth without a row.
  double any_q99 = 0, any_max = 0;
  Margin any_margin = {};
};

struct MeasuredRange {
  double least = 0, most = 0;
  [[nodiscard]] bool contains(double value) const { return value >= least && value <= most; }
};

/// Under what the errors were measured.
struct TableConditions {
  std::size_t scenes = 0, seeds = 0;
  std::size_t trials = 0;        ///< of scenes x seeds, those that were complete: only they count
  std::uint64_t space_seed = 0;  ///< of the draw of the scenes
  std::string reference;
  double share = 0.99;  ///< of runs, for which a promise holds
  MeasuredRange force_n, speed_mps, seat_speed_mps, press_s, mount_stiffness_n_m, slack_m;
};

/// Processor time beside the contact's [us of a bench second], on the table's machine. All costs
/// and the probe are processor time: a forecast is of a machine that does nothing else. Evaluation
/// is that of a campaign of 17 cloths and 6 repetitions.
struct HostCost {
  double pads_us_per_s = 0, emulators_us_per_s = 0, drivers_us_per_s = 0, recorder_us_per_s = 0;
  double export_us_per_trial = 0, evaluate_us_per_trial = 0;
  double quick_check_us_per_s = 0, full_check_us_per_s = 0;  ///< of a bench second that is checked
  double probe_us = 0;                                       ///< time of probe_us() there
};

struct FidelityTable {
  std::string made_by, commit, machine, compiler, fabrics_sha256;
  int rules = 0;  ///< of the engine
  TableConditions conditions;
  std::vector<MeasuredSetting> settings;
  HostCost host_cost;
};

/// All data of the table are of a simulated bench. Errors: parse, range, with a JSON pointer;
/// unsupported, of a table of an earlier version, and of one with a margin that was not shown to
/// hold for its share of runs.
Result<FidelityTable> parse_fidelity(std::string_view json);
/// As the file has it.
std::string to_json(const FidelityTable& table);

}  // namespace weft::sim
