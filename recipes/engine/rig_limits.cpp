#include "recipes/engine/rig_limits.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <variant>

#include "protocols/base/time.hpp"
#include "recipes/engine/fixed_axes.hpp"
#include "recipes/engine/rig_sensors.hpp"
#include "recipes/schema/object_reader.hpp"
#include "recipes/schema/quantities.hpp"

namespace weft::recipes {
namespace {

using nlohmann::json;
using quantities::deg_per_rad;
using quantities::mm_per_m;

constexpr Bounds positive_length_m{1e-6, 10, {}};
constexpr Bounds position_m{-10, 10, {}};

const Quantity slack{"slack", {{"slack_mm", mm_per_m}}};
constexpr Bounds slack_bounds_m{0, 0.05, {}};
constexpr double modelled_slack_m = 1e-3;  ///< default of a simulated rig

/// Reads the sections of one rig file, which share the members.
class RigReader {
 public:
  RigReader(RigLimits& limits, Problems& problems) : limits_(limits), problems_(problems) {}

  void read(const json& document) {
    ObjectReader rig(document, "", problems_);
    limits_.name = rig.text("name").value_or("");
    constexpr std::string_view benches[]{"simulated", "emulated", "real"};
    if (const auto bench = rig.choice("bench", {benches[0], benches[1], benches[2]}))
      limits_.bench = benches[*bench];
    rig.object("fixed", Need::optional);
    read_fixed_axes(document, limits_.geometry, problems_);
    hold_fixed();
    limits_.has_wrench = has_role(document, "wrench");
    section(rig, "limits", &RigReader::read_limits);
    section(rig, "probe", &RigReader::read_probe);
    section(rig, "plate", &RigReader::read_plate);
    section(rig, "control", &RigReader::read_control);
    if (const json* park = rig.object("park", Need::optional)) read_park(*park, rig.at("park"));
    read_sensors(document, limits_, problems_);
    read_slack(document);
    read_fabrics(rig);
  }

  /// Checks that need all sections.
  void check_together() {
    const Range& z = limits_.geometry.travel[index(Axis::z)];
    if (!z.contains(limits_.geometry.surface_z_m) || !z.contains(limits_.clear_z_m()))
      problems_.add({"/plate/surface_z_mm", "plate or clear height outside the travel of z",
                     mm(z.min) + " to " + mm(z.max),
                     mm(limits_.clear_z_m()) + " to " + mm(limits_.geometry.surface_z_m),
                     "Check plate.surface_z_mm and probe.clearance_mm"});
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) check_home(axis);
    for (const Axis axis : {Axis::rx, Axis::ry})
      if (!is_fixed(axis) && !limits_.geometry.travel[index(axis)].contains(0))
        problems_.add({"/limits/tilt_deg", "tilt range excludes 0, the upright probe",
                       "a range that contains 0", "", ""});
    if (limits_.slack_m && *limits_.slack_m <= limits_.rest_travel_m)
      problems_.add({"/probe/slack_mm", "slack not above the rest travel",
                     "above " + mm(limits_.rest_travel_m), mm(*limits_.slack_m),
                     "Lower probe.rest_travel_mm, so that the probe rests by its weight alone"});
    check_press();
    if (limits_.has_wrench && limits_.probe_weight_n >= limits_.force_cap_n)
      problems_.add({"/limits/force_cap_N", "force cap not above the weight of the probe",
                     "above " + json(limits_.probe_weight_n).dump() + " N",
                     json(limits_.force_cap_n).dump() + " N", ""});
  }

  void check_press() {
    if (limits_.has_wrench) return;
    if (limits_.most_press_depth_m <= limits_.rest_travel_m)
      problems_.add({"/limits/press_depth_mm", "press depth not above the rest travel",
                     "above " + mm(limits_.rest_travel_m) + ", probe.rest_travel_mm",
                     mm(limits_.most_press_depth_m), ""});
    if (limits_.touch_counts >= limits_.taxel_cap_counts)
      problems_.add({"/probe/touch_counts", "touch_counts not below the cap",
                     "below " + json(limits_.taxel_cap_counts).dump() + ", limits.taxel_cap_counts",
                     json(limits_.touch_counts).dump(), ""});
  }

 private:
  using Section = void (RigReader::*)(ObjectReader&);

  void section(ObjectReader& rig, std::string_view key, Section reader) {
    const json* value = rig.object(key);
    if (value == nullptr) return;
    ObjectReader object(*value, rig.at(key), problems_);
    (this->*reader)(object);
  }

  [[nodiscard]] bool is_fixed(Axis axis) const { return limits_.geometry.is_fixed(axis); }

  /// Campaigns, parks and level angles use the position of a fixed axis.
  void hold_fixed() {
    const auto place = [this](Axis axis) { return limits_.geometry.travel[index(axis)].min; };
    limits_.level = {place(Axis::rx), place(Axis::ry)};
    for (const Axis axis : all_axes)
      if (is_fixed(axis)) limits_.park[axis] = place(axis);
  }

  /// Unknown keys are refused: a misspelled limit would be a missing limit.
  void read_limits(ObjectReader& r) {
    r.set(limits_.max_speed_mps, quantities::speed, {1e-6, 1, {}}, Need::required);
    r.set(limits_.max_acceleration_mps2,
          {"acceleration", {{"acceleration_mm_s2", mm_per_m}, {"acceleration_mps2", 1}}},
          {1e-6, 100, {}}, Need::required);
    r.set(limits_.max_tilt_speed_radps, {"tilt_speed", {{"tilt_speed_deg_s", deg_per_rad}}},
          {1e-6, 10, {}});
    limits_.has_wrench ? read_force_caps(r) : read_taxel_caps(r);
    r.set(limits_.frozen_wrench_s, {"frozen_wrench", {{"frozen_wrench_s", 1}}}, {0, 3600, {}});
    const double least_frozen_s = limits_.has_wrench ? 0 : 0.05;
    r.set(limits_.frozen_taxels_s, {"frozen_taxels", {{"frozen_taxels_s", 1}}},
          {least_frozen_s, 3600, "required without a force sensor"});
    read_travel(r);
    read_tilt(r);
    r.finish();
  }

  void read_force_caps(ObjectReader& r) {
    r.set(limits_.force_cap_n, quantities::newtons("force_cap", "force_cap_N", "force_cap_n"),
          {0.1, 1000, {}}, Need::required);
    r.set(limits_.torque_cap_nm, {"torque_cap", {{"torque_cap_Nm", 1}, {"torque_cap_nm", 1}}},
          {0.01, 100, {}}, Need::required);
    for (const char* const key : {"taxel_cap_counts", "press_depth_mm", "press_depth_m"})
      r.explain(key, "key not allowed on a rig with a force sensor");
  }

  void read_taxel_caps(ObjectReader& r) {
    r.set(limits_.taxel_cap_counts, {"taxel_cap", {{"taxel_cap_counts", 1}}}, {1, 65535, {}},
          Need::required);
    r.set(limits_.most_press_depth_m, mm_or_m("press_depth", "press_depth_mm", "press_depth_m"),
          {1e-6, 0.05, {}}, Need::required);
    for (const char* const key : {"force_cap_N", "force_cap_n", "torque_cap_Nm", "torque_cap_nm"})
      r.explain(key, "cap not allowed without a device with role wrench");
  }

  void read_travel(ObjectReader& r) {
    const json* value = r.object("travel_mm");
    if (value == nullptr) return;
    ObjectReader travel(*value, r.at("travel_mm"), problems_);
    for (const Axis axis : {Axis::x, Axis::y, Axis::z})
      if (is_fixed(axis))
        travel.explain(to_string(axis), "travel not allowed for a fixed axis");
      else
        read_range(travel, {to_string(axis), {{to_string(axis), mm_per_m}}}, position_m,
                   limits_.geometry.travel[index(axis)]);
    travel.finish();
  }

  /// One range for both tilts.
  void read_tilt(ObjectReader& r) {
    if (is_fixed(Axis::rx) && is_fixed(Axis::ry))
      return r.explain("tilt_deg", "tilt range not allowed when both tilts are fixed");
    Range range;
    read_range(r, {"tilt", {{"tilt_deg", deg_per_rad}}}, {-1.5, 1.5, {}}, range);
    for (const Axis axis : {Axis::rx, Axis::ry})
      if (!is_fixed(axis)) limits_.geometry.travel[index(axis)] = range;
  }

  /// Every campaign begins at home, and a guard checks the travel from then on.
  void check_home(Axis axis) {
    const Range& range = limits_.geometry.travel[index(axis)];
    if (is_fixed(axis) || range.contains(0)) return;
    problems_.add(
        {"/limits/travel_mm/" + std::string(to_string(axis)),
         "travel excludes 0, the home position", "a range that contains 0",
         mm(range.min) + " to " + mm(range.max),
         "Extend the range to 0, and limit the probe with plate.origin_mm and plate.size_mm"});
  }

  void read_range(ObjectReader& r, const Quantity& quantity, const Bounds& bounds, Range& range) {
    const auto pair = r.pair(quantity, bounds);
    if (!pair) return;
    range = {pair->first, pair->second};
    if (range.min >= range.max)
      problems_.add({r.at(quantity), "range empty", "[least, greatest]", "", ""});
  }

  void read_probe(ObjectReader& r) {
    if (const auto mass_kg = r.quantity({"mass", {{"mass_kg", 1}}}, {1e-3, 50, {}}))
      limits_.probe_weight_n = *mass_kg * standard_gravity_mps2;
    r.set(limits_.rest_travel_m, mm_or_m("rest_travel", "rest_travel_mm", "rest_travel_m"),
          {0, 0.1, {}}, Need::required);
    read_touch(r);
    if (const auto slack_m = r.quantity(slack, slack_bounds_m, Need::optional))
      limits_.slack_m = *slack_m;
    r.set(limits_.rest_tolerance, {"rest_tolerance", {{"rest_tolerance", 1}}}, {1e-3, 1, {}});
    hangs_on_stop_ = r.flag("hangs_on_stop", Need::optional);
    r.set(limits_.clearance_m, mm_or_m("clearance", "clearance_mm", "clearance_m"),
          positive_length_m);
    r.set(limits_.geometry.probe_arm_m, mm_or_m("tilt_arm", "tilt_arm_mm", "tilt_arm_m"),
          {0, 10, {}});
    if (const auto face =
            r.pair(mm_or_m("footprint", "footprint_mm", "footprint_m"), positive_length_m))
      limits_.footprint_m = {face->first, face->second};
  }

  void read_touch(ObjectReader& r) {
    if (limits_.has_wrench)
      r.explain("touch_counts", "touch_counts not allowed on a rig with a force sensor");
    else
      r.set(limits_.touch_counts, {"touch", {{"touch_counts", 1}}}, {1, 65535, {}}, Need::required);
  }

  /// The slack of a simulated mount may be in the simulation section; such a probe hangs on a stop.
  void read_slack(const json& document) {
    const bool is_modelled = limits_.bench != "real";
    limits_.hangs_on_stop = hangs_on_stop_.value_or(is_modelled);
    if (!is_modelled || !document.is_object()) return;
    const auto simulation = document.find("simulation");
    std::optional<double> modelled_m;
    if (simulation != document.end() && simulation->is_object() &&
        simulation->contains("slack_mm")) {
      ObjectReader r(*simulation, "/simulation", problems_);
      modelled_m = r.quantity(slack, slack_bounds_m, Need::optional);
    }
    if (modelled_m && limits_.slack_m && *modelled_m != *limits_.slack_m)
      problems_.add({"/simulation/slack_mm",
                     "slack of the probe mount given twice with different values",
                     mm(*limits_.slack_m), mm(*modelled_m), "State it once, as probe.slack_mm"});
    if (!limits_.slack_m) limits_.slack_m = modelled_m.value_or(modelled_slack_m);
  }

  void read_plate(ObjectReader& r) {
    Geometry& geometry = limits_.geometry;
    if (const auto origin = r.pair(mm_or_m("origin", "origin_mm", "origin_m"), position_m))
      geometry.origin_m = {origin->first, origin->second};
    if (const auto size = r.pair(mm_or_m("size", "size_mm", "size_m"), positive_length_m))
      geometry.plate_size_m = {size->first, size->second};
    r.set(geometry.surface_z_m, mm_or_m("surface_z", "surface_z_mm", "surface_z_m"), position_m,
          Need::required);
    geometry.tilt_axis_y_m = geometry.plate_size_m.y_m / 2;
    r.set(geometry.tilt_axis_y_m, mm_or_m("tilt_axis_y", "tilt_axis_y_mm", "tilt_axis_y_m"),
          position_m);
    r.set(geometry.tilt_axis_depth_m,
          mm_or_m("tilt_axis_depth", "tilt_axis_depth_mm", "tilt_axis_depth_m"), position_m);
    if (const json* level = r.object("level", Need::optional)) read_level(*level, r.at("level"));
  }

  /// The result of weft align, written by weft run --level or by a person.
  void read_level(const json& value, const std::string& where) {
    ObjectReader r(value, where, problems_);
    const auto angle = [&](Quantity quantity, Axis axis, double& into) {
      const Range& travel = limits_.geometry.travel[index(axis)];
      r.set(into, quantity,
            {travel.min - travel_rounding, travel.max + travel_rounding,
             is_fixed(axis) ? "the position of the fixed axis" : "limits.tilt"},
            Need::required);
      into = std::clamp(into, travel.min, travel.max);
    };
    angle({"rx", {{"rx_deg", deg_per_rad}, {"rx_rad", 1}}}, Axis::rx, limits_.level.rx_rad);
    angle({"ry", {{"ry_deg", deg_per_rad}, {"ry_rad", 1}}}, Axis::ry, limits_.level.ry_rad);
    // For later readers of the data set.
    for (const Quantity& note : {Quantity{"measured", {{"measured_unix_s", 1}}},
                                 Quantity{"lean_left", {{"lean_left_rad", 1}}}})
      static_cast<void>(r.quantity(note, {0, 1e12, {}}, Need::optional));
    r.finish();
  }

  /// An axis that is not given parks at home.
  void read_park(const json& value, const std::string& where) {
    ObjectReader r(value, where, problems_);
    const auto axis = [&](Quantity quantity, Axis of) {
      const Range& travel = limits_.geometry.travel[index(of)];
      r.set(limits_.park[of], quantity, {travel.min, travel.max, "limits"});
    };
    axis(mm_or_m("x", "x_mm", "x_m"), Axis::x);
    axis(mm_or_m("y", "y_mm", "y_m"), Axis::y);
    axis({"rx", {{"rx_deg", deg_per_rad}, {"rx_rad", 1}}}, Axis::rx);
    axis({"ry", {{"ry_deg", deg_per_rad}, {"ry_rad", 1}}}, Axis::ry);
    r.finish();
  }

  void read_control(ObjectReader& r) {
    r.set(limits_.cycle_hz, {"cycle", {{"cycle_hz", 1}}}, {10, 1000, {}}, Need::required);
  }

  void read_fabrics(ObjectReader& rig) {
    const json* list = rig.array("fabrics", Need::optional);
    if (list == nullptr) return;
    for (std::size_t i = 0; i < list->size(); ++i) {
      if ((*list)[i].is_string())
        limits_.fabrics.push_back((*list)[i].get<std::string>());
      else
        problems_.add(
            {child("/fabrics", i), "fabric name invalid", "a text", brief((*list)[i]), ""});
    }
  }

  static Quantity mm_or_m(std::string_view stem, std::string_view mm_key, std::string_view m_key) {
    return {stem, {{mm_key, mm_per_m}, {m_key, 1}}};
  }

  static std::string mm(double metres) { return json(metres * mm_per_m).dump() + " mm"; }

  RigLimits& limits_;
  Problems& problems_;
  std::optional<bool> hangs_on_stop_;
};

std::string sentences(Problems& problems) {
  std::string text;
  for (const Diagnostic& problem : problems.take())
    text += (text.empty() ? "" : "\n") + to_string(problem);
  return text;
}

}  // namespace

double RigLimits::stream_rate_hz(std::string_view role, std::string_view device) const {
  if (role == "wrench") return wrench_rate_hz;
  if (role != "taxels") return 0;
  const auto array = std::ranges::find(taxel_arrays, device, &TaxelArray::device);
  return array == taxel_arrays.end() ? 0 : array->rate_hz;
}

double RigLimits::slowest_taxel_rate_hz() const {
  double slowest = taxel_rate_hz;
  for (const TaxelArray& array : taxel_arrays) slowest = std::min(slowest, array.rate_hz);
  return slowest;
}

double RigLimits::level_rise_m() const {
  return std::tan(std::abs(level.ry_rad)) * geometry.plate_size_m.x_m / 2;
}

Result<RigLimits> parse_rig_limits(std::string_view rig_json) {
  Problems problems;
  json document;
  RigLimits limits;
  if (parse_json(rig_json, {}, document, problems)) {
    RigReader reader(limits, problems);
    reader.read(document);
    if (problems.empty()) reader.check_together();
  }
  if (!problems.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "rig file",
                 .what = sentences(problems),
                 .hint = "See docs/reference/rig-keys.md for the keys of a rig file"});
  return limits;
}

}  // namespace weft::recipes
