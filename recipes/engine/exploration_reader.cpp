// Reads the explorations and the classes of a recipe; declared in recipe_reader.hpp.

#include "recipes/engine/recipe_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "recipes/schema/object_reader.hpp"
#include "recipes/schema/quantities.hpp"

namespace weft::recipes {
namespace {

using nlohmann::json;

constexpr std::array phase_order{Phase::rest, Phase::press, Phase::motion, Phase::end};
constexpr Bounds recorded_s{0.1, 3600, {}};
constexpr Bounds displacement_m{-10, 10, {}};
constexpr std::size_t most_legs = 1000;
/// Band of a recipe that states none: 5 % of the paper's 5 N.
constexpr double default_band_n = 0.25;
constexpr double unstated_n = -1;

std::string letter(Phase phase) {
  return std::string(1, to_char(phase));
}

/// Reads the phases of one exploration; the members are shared by its parts.
class PhaseReader {
 public:
  /// `press`: an exploration without phase M.
  PhaseReader(bool press, const RigLimits& limits, Problems& problems, StatedExploration& out)
      : press_(press), limits_(limits), problems_(problems), out_(out) {}

  void read(const json& list, const std::string& place) {
    if (list.size() > 2 * phase_order.size())
      return problems_.add(
          {place, "too many phases", "S, P, M, E", std::to_string(list.size()) + " phases", ""});
    for (std::size_t i = 0; i < list.size(); ++i) read_phase(list[i], child(place, i));
    check_order(place);
    check_constant_force(place);
  }

 private:
  void read_phase(const json& value, const std::string& place) {
    ObjectReader reader(value, place, problems_);
    const auto kind = reader.choice("phase", {"S", "P", "M", "E"});
    if (!kind) return;  // without a phase the valid keys are not known
    PhaseStep step;
    step.phase = phase_order[*kind];
    if (step.phase == Phase::motion)
      read_motion(reader, step);
    else
      step.duration_s = reader.quantity(quantities::duration, recorded_s).value_or(0);
    if (step.phase == Phase::press) read_press(reader, step);
    if (step.phase == Phase::rest || step.phase == Phase::end) explain_force(reader, step.phase);
    reader.finish();
    out_.exploration.phases.push_back(std::move(step));
  }

  /// By force if the rig measures it, else by depth.
  void read_press(ObjectReader& reader, PhaseStep& step) {
    if (limits_.has_wrench) {
      for (const char* key : {"press_depth_mm", "press_depth_m"})
        reader.explain(key,
                       "press depth not allowed on a rig with a force sensor; force_N is used");
      return read_force(reader, step, Need::required);
    }
    refuse_force(reader);
    step.depth_m = reader
                       .quantity(quantities::press_depth,
                                 {limits_.rest_travel_m, limits_.most_press_depth_m,
                                  "from probe.rest_travel to limits.press_depth of the rig"})
                       .value_or(0);
  }

  void refuse_force(ObjectReader& reader) {
    for (const char* key : {"force_N", "force_n", "force_band_N", "force_band_n"})
      reader.explain(
          key,
          "force not allowed on a rig without a force sensor; press_depth_mm in phase P is used");
  }

  void read_force(ObjectReader& reader, PhaseStep& step, Need need) {
    const double least_n = limits_.least_force_n();
    const Bounds force{limits_.hangs_on_stop ? 0 : least_n, limits_.force_cap_n,
                       force_bounds_reason};
    step.force_n = reader.quantity(quantities::force, force, need).value_or(unstated_n);
    if (step.force_n > 0 && step.force_n < least_n)
      problems_.add({reader.at(quantities::force), "force below the noise of the sensor",
                     "0, or at least " + json(least_n).dump() + " N",
                     json(step.force_n).dump() + " N",
                     "Raise the force; 0 moves the probe above the fabric"});
    const Bounds band{0.01, limits_.force_cap_n, {}};
    const double default_n =
        step.force_n > 0 ? std::min(default_band_n, step.force_n / 2) : default_band_n;
    step.force_band_n =
        reader.quantity(quantities::force_band, band, Need::optional).value_or(default_n);
    if (step.force_n > 0 && step.force_band_n >= step.force_n)
      problems_.add({reader.at(quantities::force_band),
                     "force band includes 0 N, which is no contact",
                     "below " + json(step.force_n).dump() + " N, the force",
                     json(step.force_band_n).dump() + " N", ""});
    const double top = step.force_n + step.force_band_n;
    if (step.force_n >= 0 && top > limits_.force_cap_n)
      problems_.add({reader.at(quantities::force), "sum of force and band above the cap",
                     "at most " + json(limits_.force_cap_n).dump() + " N", json(top).dump() + " N",
                     "Lower the force or force_band_N"});
  }

  void read_motion(ObjectReader& reader, PhaseStep& step) {
    reader.explain("duration_s", "duration not allowed in phase M; path and speed set it");
    limits_.has_wrench ? read_force(reader, step, Need::optional) : refuse_force(reader);
    const Bounds speed{least_speed_mps, limits_.max_speed_mps, "the rig's limit"};
    step.speed_mps = reader.quantity(quantities::speed, speed).value_or(0);
    if (const json* path = reader.array("path")) read_path(*path, reader.at("path"), step);
  }

  void read_path(const json& path, const std::string& place, PhaseStep& step) {
    if (path.empty() || path.size() > most_legs)
      return problems_.add({place, path.empty() ? "path empty" : "path has too many legs",
                            "1 to " + std::to_string(most_legs) + " legs",
                            std::to_string(path.size()), ""});
    Vec2 corner;
    bool good = true;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const std::optional<Vec2> leg = read_leg(path[i], child(place, i));
      good = good && leg.has_value();
      if (!leg) continue;
      corner = {corner.x_m + leg->x_m, corner.y_m + leg->y_m};
      step.path_m.push_back(corner);
    }
    if (good) out_.path_pointer = place;
  }

  std::optional<Vec2> read_leg(const json& value, const std::string& place) {
    ObjectReader reader(value, place, problems_);
    const auto dx = reader.quantity(quantities::dx, displacement_m);
    const auto dy = reader.quantity(quantities::dy, displacement_m);
    reader.finish();
    if (!dx || !dy) return std::nullopt;
    if (std::hypot(*dx, *dy) >= least_leg_m) return Vec2{*dx, *dy};
    problems_.add({place, "leg too short", "at least 0.001 mm", "", "Remove the leg"});
    return std::nullopt;
  }

  void explain_force(ObjectReader& reader, Phase phase) {
    for (const char* key : {"force_N", "force_n"})
      reader.explain(key, "force not allowed in phase " + letter(phase) +
                              ", where only the weight of the probe acts");
  }

  /// Each phase once and in this order; a press has no M.
  void check_order(const std::string& place) {
    const std::vector<PhaseStep>& phases = out_.exploration.phases;
    bool once = true;
    for (const Phase phase : phase_order) {
      const auto count = std::count_if(phases.begin(), phases.end(),
                                       [&](const PhaseStep& p) { return p.phase == phase; });
      const bool unwanted = press_ && phase == Phase::motion;
      if (count == (unwanted ? 0 : 1)) continue;
      once = false;
      problems_.add({place,
                     "phase " + letter(phase) +
                         (unwanted     ? " not allowed in a press"
                          : count == 0 ? " missing"
                                       : " given twice"),
                     press_ ? "S, P, E, each once" : "S, P, M, E, each once", "",
                     press_ ? "" : "State all four phases"});
    }
    if (!once) return;
    std::vector<Phase> expected(phase_order.begin(), phase_order.end());
    if (press_) std::erase(expected, Phase::motion);
    const auto same = [](const PhaseStep& p, Phase phase) { return p.phase == phase; };
    if (!std::equal(phases.begin(), phases.end(), expected.begin(), expected.end(), same))
      problems_.add(
          {place, "phases in the wrong order", press_ ? "S, P, E" : "S, P, M, E", "", ""});
    if (press_) out_.path_pointer = place;  // its point must be on the plate
  }

  /// One set point per trial: the force loop is switched on once, for both P and M.
  void check_constant_force(const std::string& place) {
    std::vector<PhaseStep>& phases = out_.exploration.phases;
    const auto find = [&](Phase phase) {
      return std::find_if(phases.begin(), phases.end(),
                          [&](const PhaseStep& p) { return p.phase == phase; });
    };
    const auto press = find(Phase::press);
    const auto motion = find(Phase::motion);
    if (press == phases.end()) return;
    if (press->force_n == unstated_n) press->force_n = 0;  // already reported as a problem
    if (motion == phases.end()) return;
    if (motion->force_n == unstated_n) motion->force_n = press->force_n;
    if (motion->force_n != press->force_n)
      problems_.add({place, "forces of phases P and M differ",
                     json(press->force_n).dump() + " N in both",
                     json(motion->force_n).dump() + " N in M", "Remove force_N from phase M"});
  }

  bool press_;
  const RigLimits& limits_;
  Problems& problems_;
  StatedExploration& out_;
};

constexpr std::size_t longest_model_name = 1000;
constexpr double surest = 0.999999;  // largest accepted probability

std::optional<StopEarly> read_stop_early(ObjectReader& vote) {
  std::optional<ObjectReader> reader = vote.section("stop_early");
  if (!reader) return std::nullopt;
  StopEarly stop;
  reader->set(stop.sure_probability, quantities::sure_probability, {0.5, surest, "above chance"},
              Need::required);
  reader->set(stop.least_slide_s, quantities::least_slide, recorded_s, Need::required);
  reader->finish();
  return stop;
}

void read_live_vote(ObjectReader& exploration, StatedExploration& stated, Problems& problems) {
  std::optional<ObjectReader> reader = exploration.section("live_vote");
  if (!reader) return;
  LiveVote vote;
  vote.model = reader->text("model").value_or("");
  if (reader->has("model") && (vote.model.empty() || vote.model.size() > longest_model_name))
    problems.add({reader->at("model"), "length of the file name out of range", "1 to 1000 bytes",
                  std::to_string(vote.model.size()) + " bytes",
                  "Create the file with weft fabric train --live"});
  vote.stop_early = read_stop_early(*reader);
  reader->finish();
  stated.exploration.live_vote = std::move(vote);
}

void read_start(ObjectReader& reader, StatedExploration& stated) {
  std::optional<ObjectReader> start = reader.section("start");
  if (!start) return;
  const auto x = start->quantity(quantities::x, displacement_m);
  const auto y = start->quantity(quantities::y, displacement_m);
  start->finish();
  if (x && y) stated.start_m = Vec2{*x, *y};
}

void read_class(const std::string& name, const json& members, const std::string& place,
                const std::vector<std::string>& fabrics, std::vector<std::string>& class_of,
                Problems& problems) {
  if (!is_name(name))
    problems.add({place, "class name invalid", std::string(name_rule), brief(name), ""});
  if (!members.is_array() || members.empty())
    return problems.add({place, "fabrics of a class invalid", "a list of fabrics of the recipe",
                         brief(members), ""});
  for (std::size_t i = 0; i < members.size(); ++i) {
    const auto found = members[i].is_string()
                           ? std::ranges::find(fabrics, members[i].get<std::string>())
                           : fabrics.end();
    if (found == fabrics.end()) {
      problems.add(
          {child(place, i), "fabric not in the recipe", "one of /fabrics", brief(members[i]), ""});
      continue;
    }
    std::string& its_class = class_of[static_cast<std::size_t>(found - fabrics.begin())];
    if (!its_class.empty())
      problems.add({child(place, i), "fabric in more than one class", "each fabric once",
                    *found + " in " + its_class, ""});
    its_class = name;
  }
}

}  // namespace

StatedExploration read_exploration(const std::string& name, const json& value,
                                   const std::string& pointer, const RigLimits& limits,
                                   Problems& problems) {
  StatedExploration stated;
  stated.exploration.name = name;
  stated.pointer = pointer;
  ObjectReader reader(value, pointer, problems);
  reader.text("description", Need::optional);
  read_start(reader, stated);
  read_live_vote(reader, stated, problems);
  const bool press = reader.choice("kind", {"slide", "press"}, Need::optional) == 1;
  if (press && stated.exploration.live_vote)
    problems.add({reader.at("live_vote"), "live vote not allowed in a press, which has no phase M",
                  "", "", ""});
  if (const json* phases = reader.array("phases"))
    PhaseReader(press, limits, problems, stated).read(*phases, reader.at("phases"));
  reader.finish();
  return stated;
}

std::vector<std::string> read_classes(ObjectReader& recipe, const std::vector<std::string>& fabrics,
                                      Problems& problems) {
  const json* classes = recipe.object("classes", Need::optional);
  if (classes == nullptr) return {};
  const std::string place = recipe.at("classes");
  if (classes->size() < 2)
    problems.add(
        {place, "too few classes", "at least 2 classes", std::to_string(classes->size()), ""});
  std::vector<std::string> class_of(fabrics.size());
  for (const auto& [name, members] : classes->items())
    read_class(name, members, child(place, name), fabrics, class_of, problems);
  for (std::size_t i = 0; i < fabrics.size(); ++i)
    if (class_of[i].empty())
      problems.add({place, "fabric without a class", "each fabric once", fabrics[i], ""});
  return class_of;
}

}  // namespace weft::recipes
