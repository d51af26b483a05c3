#pragma once
// Every quantity that recipes and rig files may hold, with its accepted spellings. The JSON Schema
// lists the same ones; a test compares them.

#include <numbers>

#include "recipes/schema/object_reader.hpp"

namespace weft::recipes::quantities {

inline constexpr double mm_per_m = 1e3;
inline constexpr double deg_per_rad = 180 / std::numbers::pi;

inline Quantity force(std::string_view stem, std::string_view newton_upper,
                      std::string_view newton_lower) {
  return {stem, {{newton_upper, 1}, {newton_lower, 1}}};
}
inline Quantity duration() {
  return {"duration", {{"duration_s", 1}}};
}
inline Quantity force() {
  return force("force", "force_N", "force_n");
}
inline Quantity force_band() {
  return force("force_band", "force_band_N", "force_band_n");
}
inline Quantity contact_force() {
  return force("contact_force", "contact_force_N", "contact_force_n");
}
inline Quantity speed() {
  return {"speed", {{"speed_mm_s", mm_per_m}, {"speed_mps", 1}}};
}
inline Quantity seat_speed() {
  return {"seat_speed", {{"seat_speed_mm_s", mm_per_m}, {"seat_speed_mps", 1}}};
}
inline Quantity transfer_speed() {
  return {"transfer_speed", {{"transfer_speed_mm_s", mm_per_m}, {"transfer_speed_mps", 1}}};
}
inline Quantity dx() {
  return {"dx", {{"dx_mm", mm_per_m}, {"dx_m", 1}}};
}
inline Quantity dy() {
  return {"dy", {{"dy_mm", mm_per_m}, {"dy_m", 1}}};
}
inline Quantity x() {
  return {"x", {{"x_mm", mm_per_m}, {"x_m", 1}}};
}
inline Quantity y() {
  return {"y", {{"y_mm", mm_per_m}, {"y_m", 1}}};
}
inline Quantity dwell() {
  return {"dwell", {{"dwell_s", 1}}};
}
inline Quantity budget() {
  return {"budget", {{"budget_s", 1}}};
}
inline Quantity timeout() {
  return {"timeout", {{"timeout_s", 1}}};
}
inline Quantity lost() {
  return {"lost", {{"lost_fraction", 1}}};
}
inline Quantity saturated() {
  return {"saturated", {{"saturated_fraction", 1}}};
}
inline Quantity still_taxel() {
  return {"still_taxel", {{"still_taxel_s", 1}}};
}
inline Quantity force_in_band() {
  return {"force_in_band", {{"force_in_band_fraction", 1}}};
}
inline Quantity sure_probability() {
  return {"sure_probability", {{"sure_probability", 1}}};
}
inline Quantity least_slide() {
  return {"least_slide", {{"least_slide_s", 1}}};
}
inline Quantity people() {
  return {"people", {{"people_s", 1}}};
}
inline Quantity at_most() {
  return {"at_most", {{"at_most_s", 1}}};
}
inline Quantity mount_timeout() {
  return {"mount_timeout", {{"mount_timeout_s", 1}}};
}

}  // namespace weft::recipes::quantities
