#pragma once
// All quantities of recipes and rig files with their accepted spellings. The JSON Schema lists the
// same ones; a test compares them.

#include <numbers>

#include "recipes/schema/object_reader.hpp"

namespace weft::recipes::quantities {

inline constexpr double mm_per_m = 1e3;
inline constexpr double deg_per_rad = 180 / std::numbers::pi;

/// A force with two spellings of its unit.
inline Quantity newtons(std::string_view stem, std::string_view newton_upper,
                        std::string_view newton_lower) {
  return {stem, {{newton_upper, 1}, {newton_lower, 1}}};
}
inline const Quantity duration{"duration", {{"duration_s", 1}}};
inline const Quantity force = newtons("force", "force_N", "force_n");
inline const Quantity force_band = newtons("force_band", "force_band_N", "force_band_n");
inline const Quantity press_depth{"press_depth",
                                  {{"press_depth_mm", mm_per_m}, {"press_depth_m", 1}}};
inline const Quantity contact_force =
    newtons("contact_force", "contact_force_N", "contact_force_n");
inline const Quantity speed{"speed", {{"speed_mm_s", mm_per_m}, {"speed_mps", 1}}};
inline const Quantity seat_speed{"seat_speed",
                                 {{"seat_speed_mm_s", mm_per_m}, {"seat_speed_mps", 1}}};
inline const Quantity transfer_speed{
    "transfer_speed", {{"transfer_speed_mm_s", mm_per_m}, {"transfer_speed_mps", 1}}};
inline const Quantity dx{"dx", {{"dx_mm", mm_per_m}, {"dx_m", 1}}};
inline const Quantity dy{"dy", {{"dy_mm", mm_per_m}, {"dy_m", 1}}};
inline const Quantity x{"x", {{"x_mm", mm_per_m}, {"x_m", 1}}};
inline const Quantity y{"y", {{"y_mm", mm_per_m}, {"y_m", 1}}};
inline const Quantity dwell{"dwell", {{"dwell_s", 1}}};
inline const Quantity budget{"budget", {{"budget_s", 1}}};
inline const Quantity timeout{"timeout", {{"timeout_s", 1}}};
inline const Quantity lost{"lost", {{"lost_fraction", 1}}};
inline const Quantity saturated{"saturated", {{"saturated_fraction", 1}}};
inline const Quantity still_taxel{"still_taxel", {{"still_taxel_s", 1}}};
inline const Quantity force_in_band{"force_in_band", {{"force_in_band_fraction", 1}}};
inline const Quantity sure_probability{"sure_probability", {{"sure_probability", 1}}};
inline const Quantity least_slide{"least_slide", {{"least_slide_s", 1}}};
inline const Quantity people{"people", {{"people_s", 1}}};
inline const Quantity at_most{"at_most", {{"at_most_s", 1}}};
inline const Quantity mount_timeout{"mount_timeout", {{"mount_timeout_s", 1}}};

}  // namespace weft::recipes::quantities
