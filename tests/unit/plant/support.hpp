#pragma once
// The shipped table of fabrics, and a fabric without any of the switchable mechanisms.

#include <cmath>
#include <string>
#include <vector>

#include "sim/plant/contact.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/height_field.hpp"
#include "sim/plant/pads.hpp"
#include "tests/unit/source_text.hpp"

namespace weft::sim::test {

inline std::string fabrics_text() {
  return testing::source_text("sim/fabrics.json");
}

inline FabricLibrary shipped_library() {
  auto read = parse_fabrics(fabrics_text());
  WEFT_ASSERT(read.has_value());
  return *read;
}

/// The fabrics of the table with their own KES values, under a rigid face: the stiffest contacts
/// and the steepest surfaces.
inline FabricLibrary library() {
  FabricLibrary out = shipped_library();
  std::erase_if(out.fabrics, [](const Fabric& fabric) { return fabric.height_rms_m > 0; });
  const MaterialParams rigid;
  out.params.cover = rigid.cover;
  out.params.height_per_roughness = rigid.height_per_roughness;
  out.params.roughness_exponent = rigid.roughness_exponent;
  out.spread = {};
  out.pads.reset();
  return out;
}

inline constexpr MaterialSwitches plain_cloth{false, false, false, false, false, false};

inline Patch patch_of(const FabricLibrary& table, const std::string& name, std::uint64_t seed,
                      const MaterialSwitches& switches = {}) {
  auto patch = cut_patch(*table.find(name), table.params, table.spread, switches, seed);
  WEFT_ASSERT(patch.has_value());
  return *patch;
}

/// Height of a surface at one point, wave by wave [m].
inline double height_at_m(const HeightField& field, double u_m, double v_m) {
  using Axis = HeightField::Axis;
  const double wander_u = field.wander(Axis::u, u_m), wander_v = field.wander(Axis::v, v_m);
  double height = 0;
  for (const HeightField::Term& term : field.terms())
    height += term.amplitude_m * std::cos(HeightField::phase(term, Axis::u, u_m, wander_u) +
                                          HeightField::phase(term, Axis::v, v_m, wander_v));
  return height;
}

/// Capacitance of a pad under a pressure >= 0, which closes its gap [F].
inline double capacitance_under_f(const PadParams& pad, double pressure_pa) {
  return capacitance_f(pad, pad.gap_m / (1 + pressure_pa / pad.gap_pressure_pa));
}

inline constexpr double plate_z = 0.06;

inline ContactGeometry level_plate() {
  ContactGeometry geometry;
  geometry.plate_z_m = plate_z;
  return geometry;
}

inline ContactMaterial plain(const std::string& name) {
  return patch_of(library(), name, 1, plain_cloth).material;
}

}  // namespace weft::sim::test
