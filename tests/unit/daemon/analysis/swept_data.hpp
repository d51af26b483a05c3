#pragma once
// A sweep and a campaign of repetitions in memory.

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "classifier/design/resample.hpp"
#include "daemon/analysis/design/sweep_analysis.hpp"

namespace weft::daemon::test_sweep {

inline constexpr double frames_hz = 37;
inline constexpr std::size_t taxels = 2;

inline std::string bench17() {
  std::ifstream in(std::string(WEFT_SOURCE_DIR) + "/sim/rigs/bench17.json");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

inline const char* const swept_recipe = R"({
  "schema_version": 1, "name": "swept", "fabrics": ["denim", "silk", "wool"],
  "sweep": {"factors": [{"name": "force_N", "values": [3, 5]}, {"name": "speed_mm_s", "values": [1, 4]}],
            "replicates": 4},
  "explorations": {"rub": {"phases": [
    {"phase": "S", "duration_s": 1}, {"phase": "P", "force_N": 5, "duration_s": 1},
    {"phase": "M", "speed_mm_s": 2, "path": [{"dx_mm": 0, "dy_mm": 20}]},
    {"phase": "E", "duration_s": 1}]}}})";

/// Noise of one count, and in phase M a texture of 1 mm with an amplitude given by the force. The
/// levels of the fabrics differ by `gap` deviations.
inline void add_trial(Dataset& set, std::size_t fabric, std::size_t repetition, double force_n,
                      double speed_mps, double gap, classifier::RandomEngine& engine) {
  static const std::vector<std::string> names{"denim", "silk", "wool"};
  classifier::Trial trial;
  trial.label = names[fabric];
  trial.group = std::to_string(repetition);
  trial.file = "t" + std::to_string(set.trials.size());
  trial.taxels = taxels;
  const auto motion = static_cast<std::size_t>(0.02 / speed_mps * frames_hz);
  const auto add = [&](Phase phase, std::size_t samples) {
    for (std::size_t i = 0; i < samples; ++i) {
      const double wave =
          phase == Phase::motion
              ? 20 * force_n *
                    std::sin(2 * M_PI * speed_mps / 1e-3 * static_cast<double>(i) / frames_hz)
              : 0;
      for (std::size_t t = 0; t < taxels; ++t)
        trial.counts.push_back(std::round(5000 + gap * static_cast<double>(fabric) + wave +
                                          classifier::design::normal_draw(engine)));
      trial.phase.push_back(phase);
    }
  };
  add(Phase::rest, 37);
  add(Phase::press, 37);
  add(Phase::motion, motion);
  add(Phase::end, 37);
  TrialRecord record;
  record.spec.index = static_cast<std::uint32_t>(set.trials.size());
  record.spec.label = trial.label;
  record.spec.group = trial.group;
  record.spec.repetition = static_cast<std::uint32_t>(repetition);
  if (!set.info.factors.empty()) {
    record.spec.exploration = "rub-" + std::to_string(static_cast<int>(force_n)) + "N-" +
                              std::to_string(static_cast<int>(speed_mps * 1e3)) + "mm_s";
    record.spec.factors = {force_n, speed_mps};
  } else {
    record.spec.exploration = "rub";
  }
  for (std::size_t i = 0; i < trial.samples(); ++i)
    record.t_ns.push_back(static_cast<std::int64_t>(static_cast<double>(i) / frames_hz * 1e9));
  set.trials.push_back(std::move(trial));
  set.records.push_back(std::move(record));
}

inline DatasetInfo info_of(BenchKind kind) {
  DatasetInfo info;
  info.kind = kind;
  info.name = "swept";
  info.recipe_json = swept_recipe;
  info.rig_json = bench17();
  info.taxel_rate_hz = frames_hz;
  return info;
}

/// The fabrics differ only at 5 N.
inline Dataset swept(BenchKind kind, std::uint64_t seed = 1) {
  Dataset set;
  set.info = info_of(kind);
  set.info.factors = {"force_n", "speed_mps"};
  classifier::RandomEngine engine(seed);
  for (std::size_t r = 1; r <= 4; ++r)
    for (std::size_t fabric = 0; fabric < 3; ++fabric)
      for (const double force_n : {3.0, 5.0})
        for (const double speed_mps : {0.001, 0.004})
          add_trial(set, fabric, r, force_n, speed_mps, force_n > 4 ? 30 : 0, engine);
  return set;
}

inline Dataset repeated(std::size_t repetitions, double gap) {
  Dataset set;
  set.info = info_of(BenchKind::simulated);
  classifier::RandomEngine engine(3);
  for (std::size_t r = 1; r <= repetitions; ++r)
    for (std::size_t fabric = 0; fabric < 3; ++fabric)
      add_trial(set, fabric, r, 5, 0.004, gap, engine);
  return set;
}

inline SweepAnalysis analysed(const Dataset& set) {
  SweepOptions options;
  options.resamples = 300;
  const auto found = analyse_sweep(std::span(&set, 1), options);
  REQUIRE(found);
  REQUIRE(found->size() == 1);
  return found->front();
}

}  // namespace weft::daemon::test_sweep
