#include "recipes/engine/fixed_axes.hpp"

#include <nlohmann/json.hpp>

#include "recipes/schema/object_reader.hpp"
#include "recipes/schema/quantities.hpp"

namespace weft::recipes {

void read_fixed_axes(const nlohmann::json& rig, Geometry& geometry, Problems& problems) {
  using quantities::deg_per_rad;
  using quantities::mm_per_m;
  if (!rig.is_object() || !rig.contains("fixed")) return;
  constexpr Bounds place_m{-10, 10, {}};
  constexpr Bounds angle_rad{-1.5, 1.5, {}};
  ObjectReader reader(rig["fixed"], "/fixed", problems);
  const auto read = [&](Axis axis, const Quantity& quantity, const Bounds& bounds) {
    const auto place = reader.quantity(quantity, bounds, Need::optional);
    if (!place) return;
    geometry.travel[index(axis)] = {*place, *place};
    geometry.fixed[index(axis)] = true;
  };
  read(Axis::y, {"y", {{"y_mm", mm_per_m}, {"y_m", 1}}}, place_m);
  read(Axis::rx, {"rx", {{"rx_deg", deg_per_rad}, {"rx_rad", 1}}}, angle_rad);
  read(Axis::ry, {"ry", {{"ry_deg", deg_per_rad}, {"ry_rad", 1}}}, angle_rad);
  for (const char* const key : {"x_mm", "x_m", "z_mm", "z_m"})
    reader.explain(key, "x and z cannot be fixed: every rig needs a stage for both");
  reader.finish();
}

}  // namespace weft::recipes
