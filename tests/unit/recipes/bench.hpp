#pragma once
// The rig and the recipe from which the tests start.

#include <fstream>
#include <sstream>
#include <string>

#include "recipes/engine/plan.hpp"

namespace weft::recipes::test {

inline const char* const rig_json = R"({
  "name": "test17", "bench": "simulated", "devices": [],
  "limits": {"speed_mm_s": 4, "acceleration_mm_s2": 20, "force_cap_N": 10, "torque_cap_Nm": 2,
             "travel_mm": {"x": [0, 150], "y": [0, 150], "z": [0, 150]}, "tilt_deg": [-5, 5]},
  "probe": {"mass_kg": 0.2, "rest_travel_mm": 0.5, "footprint_mm": [16, 16], "clearance_mm": 8},
  "plate": {"origin_mm": [0, 0], "surface_z_mm": 100, "size_mm": [150, 150]},
  "control": {"cycle_hz": 100}, "simulation": {"level": "L1"}})";

inline RigLimits limits() {
  Result<RigLimits> parsed = parse_rig_limits(rig_json);
  WEFT_ASSERT(parsed.has_value());
  return *parsed;
}

inline const char* const small_recipe = R"({
  "schema_version": 1, "name": "small", "fabrics": ["denim", "silk"], "repetitions": 2,
  "explorations": {"M2": {"phases": [
    {"phase": "S", "duration_s": 3},
    {"phase": "P", "force_N": 5, "duration_s": 6},
    {"phase": "M", "speed_mm_s": 2, "path": [{"dx_mm": 0, "dy_mm": 50}, {"dx_mm": 50, "dy_mm": 0}]},
    {"phase": "E", "duration_s": 2}]}}})";

/// `text` with the first `from` replaced; the text must contain it.
inline std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  WEFT_ASSERT(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

inline std::string small_with(const std::string& from, const std::string& to) {
  return with(small_recipe, from, to);
}

inline Plan plan_of(const std::string& recipe) {
  CheckReport report = check_recipe(recipe, limits());
  WEFT_ASSERT(report.plan.has_value());
  return *std::move(report.plan);
}

inline std::string source_file(const std::string& path) {
  std::ifstream in(std::string(WEFT_SOURCE_DIR) + "/" + path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace weft::recipes::test
