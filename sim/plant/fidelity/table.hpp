#pragma once
// The measured trade between speed and accuracy (sim/fidelity.json, made by `weft trade sim`), and
// the choice that it allows.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/plant/fidelity/setting.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::sim {

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
