#pragma once
// The measured trade between speed and accuracy (sim/fidelity.json, made by `weft trade sim`), and
// the choice that it allows.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/plant/plant.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::sim {

/// The pads' conversion times are the plant's grid: it moves at most this far at once, but at L1,
/// whose balance may span the conversions of a scan.
constexpr double grid_step_s = 1e-9 * static_cast<double>(pad_timing::stage_ns);

/// How finely a bench is simulated. Everything else about a rig says what is simulated.
struct FidelitySetting {
  Level level = Level::quasistatic;
  Integrator integrator = Integrator::midpoint;  ///< from L2 on
  double step_s = 0;                             ///< from L1 on, at most; 0: the plant's grid

  friend bool operator==(const FidelitySetting&, const FidelitySetting&) = default;
};

/// "L0", "L1 3.072 ms", "L2 adaptive 0.192 ms".
std::string to_string(const FidelitySetting& setting);
std::string_view to_string(Integrator integrator);
/// Errors: invalid_argument.
Result<Integrator> integrator_from(std::string_view name);

FidelitySetting setting_of(const PlantParams& params);
void apply(const FidelitySetting& setting, PlantParams& params);

/// What a run at `setting` is compared with: the same equations with a quarter of the step and,
/// from below L2, the next level up. Of L0, which has no step, the next level alone.
std::vector<FidelitySetting> finer_than(const FidelitySetting& setting);

/// One setting on one scene.
struct FidelityRow {
  std::string scene;  ///< "press", "slide", "stick_slip", "retouch", "fabrics17"
  FidelitySetting setting;
  double error_max_n = 0;  ///< of the force, against a finer run or the next level up
  double error_rms_n = 0;
  double times_real_time = 0;  ///< on one core of the table's machine
};

struct FidelityTable {
  std::string made_by, machine, commit;
  std::vector<FidelityRow> rows;
};

/// Errors: parse, range, with a JSON pointer. All data of the table are of a simulated bench.
Result<FidelityTable> parse_fidelity(std::string_view json);

struct FidelityRequest {
  std::optional<double> accuracy_n{};       ///< largest error of the force
  std::optional<double> times_real_time{};  ///< least speed
  std::optional<Level> level{};             ///< this one and no other
};

/// What a setting promises for a whole scene: the worst over the table's scenes that it involves.
struct FidelityOffer {
  FidelitySetting setting;
  double error_max_n = 0;
  double error_rms_n = 0;
  double times_real_time = 0;
};
/// "L2 midpoint 0.384 ms (2.1 mN, 1 200 times real time)".
std::string to_string(const FidelityOffer& offer);

/// Settings that a bench can run, that provide the scene and are measured on all that it involves;
/// fastest first. A bench's steps end on its grid: longer ones are no offer.
std::vector<FidelityOffer> offers(const FidelityTable& table, const Scene& scene);

/// With an accuracy the fastest setting that keeps it, with a speed alone the most accurate one
/// that reaches it. Depends on its arguments and nothing else; equal offers: the lower level, then
/// the longer step.
/// Errors: unsupported, naming the nearest offers.
Result<FidelityOffer> choose(const FidelityTable& table, const Scene& scene,
                             const FidelityRequest& request);

/// "10mN", "0.01 N", "0.5%" (of 5 N, the paper's load), in N. Errors: invalid_argument, range.
Result<double> parse_accuracy_n(std::string_view text);
/// "1000x". Errors: invalid_argument, range.
Result<double> parse_times_real_time(std::string_view text);

}  // namespace weft::sim
