// What the rig is, for who draws it or says what it can do.

#include <nlohmann/json.hpp>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

using nlohmann::json;
using recipes::RigLimits;
using rpc::Outcome;

json point_of(const recipes::Vec2& point) {
  return {{"x_m", point.x_m}, {"y_m", point.y_m}};
}

json travel_of(const recipes::Geometry& geometry) {
  json out = json::object();
  for (const recipes::Axis axis : recipes::all_axes) {
    const recipes::Range& range = geometry.travel[recipes::index(axis)];
    const std::string unit = recipes::is_linear(axis) ? "_m" : "_rad";
    out[std::string(to_string(axis)) + unit] = {range.min, range.max};
  }
  return out;
}

Outcome described(const Services& services) {
  const auto opened = open_rig(services.rig, {});
  if (!opened) return refused(opened.error());
  const RigLimits& rig = opened->limits;
  return format_text({{"rig", services.rig_name},
                      {"bench", rig.bench},
                      {"simulated", rig.bench != "real"},
                      {"force_cap_n", rig.force_cap_n},
                      {"torque_cap_nm", rig.torque_cap_nm},
                      {"travel", travel_of(rig.geometry)},
                      {"plate",
                       {{"origin", point_of(rig.geometry.origin_m)},
                        {"size", point_of(rig.geometry.plate_size_m)},
                        {"surface_z_m", rig.geometry.surface_z_m}}},
                      {"footprint", point_of(rig.footprint_m)},
                      {"clearance_m", rig.clearance_m},
                      {"taxels", rig.taxels},
                      {"fabrics", rig.fabrics}});
}

}  // namespace

void add_rig_description(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add({"rig.describe",
               "what the rig is and can do, as its file says",
               {},
               {},
               {},
               "rig, bench (simulated, emulated, real), simulated, force_cap_n, torque_cap_nm, "
               "travel by axis, plate: origin, size, surface_z_m; footprint of the probe, "
               "clearance_m, taxels, fabrics"},
              [s](const rpc::Call&) { return described(*s); });
}

}  // namespace weft::daemon::api
