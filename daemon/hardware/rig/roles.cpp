#include "daemon/hardware/rig/roles.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "recipes/engine/fixed_axes.hpp"

namespace weft::daemon {
namespace {

constexpr std::array<std::string_view, 3> sensor_roles{"wrench", "taxels", "vibro"};

Status once(std::string_view role, std::ptrdiff_t count) {
  if (count == 1) return {};
  return fail({.where = "/devices",
               .what = "wrong number of devices with role " + std::string(role),
               .expected = "one device",
               .got = std::to_string(count) + " devices"});
}

/// The key that fixes an axis, with its unit (mm or deg).
std::string fixed_key(recipes::Axis axis) {
  return std::string(to_string(axis)) + (recipes::is_linear(axis) ? "_mm" : "_deg");
}

Status axis_filled(recipes::Axis axis, std::ptrdiff_t count, bool fixed) {
  const std::string name(to_string(axis));
  if (fixed && count > 0)
    return fail({.where = "/fixed/" + fixed_key(axis),
                 .what = "axis " + name + " both fixed and moved by a stage",
                 .expected = "only one of the two",
                 .got = "a device with role " + name,
                 .hint = "Remove the key or the device"});
  if (fixed || count > 0) return fixed ? Status{} : once(name, count);
  const bool needed = axis == recipes::Axis::x || axis == recipes::Axis::z;
  return fail({.where = "/devices",
               .what = "wrong number of devices with role " + name,
               .expected = needed ? "one device" : "one device, or the axis fixed",
               .got = "0 devices",
               .hint = needed ? ""
                              : "Add a device, or state the position of the axis: \"fixed\": "
                                "{\"" +
                                    fixed_key(axis) + "\": 0}"});
}

}  // namespace

bool is_role(std::string_view role) {
  const auto is_axis = [&](recipes::Axis axis) { return to_string(axis) == role; };
  return std::ranges::any_of(recipes::all_axes, is_axis) ||
         std::ranges::find(sensor_roles, role) != sensor_roles.end();
}

Result<FixedAxes> read_fixed(const nlohmann::json& rig) {
  recipes::Problems problems;
  recipes::Geometry geometry;
  recipes::read_fixed_axes(rig, geometry, problems);
  if (!problems.empty()) {
    const recipes::Diagnostic first = problems.take().front();
    return fail({.where = first.pointer,
                 .what = first.message,
                 .expected = first.expected,
                 .got = first.got,
                 .hint = first.hint});
  }
  FixedAxes fixed;
  for (const recipes::Axis axis : recipes::all_axes)
    if (geometry.is_fixed(axis))
      fixed[recipes::index(axis)] = geometry.travel[recipes::index(axis)].min;
  return fixed;
}

/// Whether a plan needs taxels is checked when it is made, by recipes::check_recipe().
Status roles_filled(const std::vector<std::string>& roles, const FixedAxes& fixed) {
  const auto count = [&](std::string_view role) { return std::ranges::count(roles, role); };
  for (const recipes::Axis axis : recipes::all_axes)
    if (Status s =
            axis_filled(axis, count(to_string(axis)), fixed[recipes::index(axis)].has_value());
        !s)
      return s;
  for (const std::string_view role : {"wrench", "vibro"})
    if (count(role) > 1)
      return fail({.where = "/devices",
                   .what = "too many devices with role " + std::string(role),
                   .expected = "at most one device",
                   .got = std::to_string(count(role)) + " devices"});
  if (count("wrench") + count("taxels") > 0) return {};
  return fail({.where = "/devices",
               .what = "rig has neither a force sensor nor taxels",
               .expected = "a device with the role wrench or taxels",
               .got = "none",
               .hint = "Add one of them to detect contact with the fabric"});
}

}  // namespace weft::daemon
