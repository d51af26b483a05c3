// Makes and checks the explorations in the cells of a sweep; declared in recipe_reader.hpp.

#include "recipes/engine/recipe_reader.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <span>

#include "recipes/engine/motion.hpp"

namespace weft::recipes {
namespace {

constexpr std::size_t longest_name = 64;

double length_m(const std::vector<Vec2>& path) {
  double sum = 0;
  Vec2 from;
  for (const Vec2& to : path) {
    sum += std::hypot(to.x_m - from.x_m, to.y_m - from.y_m);
    from = to;
  }
  return sum;
}

/// Turned about the start of the path. Exact at whole quarter turns, so that a path along one axis
/// commands no motion of the other.
Vec2 turned(const Vec2& corner, double direction_rad) {
  constexpr double quarter_rad = std::numbers::pi / 2, rounding = 1e-12;
  double cosine = std::cos(direction_rad), sine = std::sin(direction_rad);
  const double quarters = std::round(direction_rad / quarter_rad);
  if (std::abs(direction_rad / quarter_rad - quarters) < rounding) {
    cosine = std::round(cosine);
    sine = std::round(sine);
  }
  return {cosine * corner.x_m - sine * corner.y_m, sine * corner.x_m + cosine * corner.y_m};
}

void set(FactorKind kind, double value, Exploration& exploration) {
  for (PhaseStep& step : exploration.phases) {
    const bool motion = step.phase == Phase::motion, press = step.phase == Phase::press;
    if (kind == FactorKind::force && (motion || press)) step.force_n = value;
    if (kind == FactorKind::speed && motion) step.speed_mps = value;
    if (kind == FactorKind::press && press) step.duration_s = value;
    if (kind == FactorKind::direction && motion)
      for (Vec2& corner : step.path_m) corner = turned(corner, value);
    if (kind != FactorKind::stroke || !motion) continue;
    const double scale = value / length_m(step.path_m);
    for (Vec2& corner : step.path_m) corner = {corner.x_m * scale, corner.y_m * scale};
  }
}

/// Whether the path of a cell differs from the path that the recipe states.
bool changes_path(FactorKind kind) {
  return kind == FactorKind::stroke || kind == FactorKind::direction;
}

StatedExploration in_cell(const StatedExploration& base, const Sweep& sweep,
                          const std::vector<std::size_t>& cell) {
  StatedExploration out = base;
  out.exploration.factors = sweep.values(cell);
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const Factor& factor = sweep.factors[i];
    const double value = factor.values[cell[i]];
    set(factor.kind, value, out.exploration);
    out.exploration.name += "-" + format_factor(factor.kind, value);
    if (changes_path(factor.kind)) out.path_pointer = factor.pointers[cell[i]];
  }
  return out;
}

/// Length of the shortest leg of a path that a stroke has scaled.
double shortest_leg_m(const Exploration& exploration) {
  double shortest = HUGE_VAL;
  Vec2 from;
  for (const Vec2& to : exploration.path_m()) {
    shortest = std::min(shortest, std::hypot(to.x_m - from.x_m, to.y_m - from.y_m));
    from = to;
  }
  return shortest;
}

/// A stroke keeps the shape of the path, so its shortest leg may become too short.
void check_legs(const StatedExploration& stated, Problems& problems) {
  const double shortest = shortest_leg_m(stated.exploration);
  if (shortest >= least_leg_m) return;
  problems.add({stated.path_pointer, "leg of the path too short at this stroke",
                "legs of at least 0.001 mm",
                nlohmann::json(shortest * 1e3).dump() + " mm in " + stated.exploration.name,
                "Use a longer stroke, or remove the short leg"});
}

/// Reports the longest name among the cells of one exploration, once.
void check_names(const std::string& pointer, std::span<const StatedExploration> cells,
                 Problems& problems) {
  const auto longest = std::ranges::max_element(
      cells, {}, [](const StatedExploration& cell) { return cell.exploration.name.size(); });
  const std::string& name = longest->exploration.name;
  if (name.size() > longest_name)
    problems.add({pointer, "exploration name too long for the names of its cells",
                  "at most 64 bytes with its values", name, "Shorten the name"});
}

std::string mm(double metres) {
  return nlohmann::json(std::round(metres * 1e6) / 1e3).dump() + " mm";
}

/// One direction of the plate, with the names for messages.
struct LayoutAxis {
  const char* name;
  const char* key;
  double Vec2::*part;
  Axis axis;
};
constexpr LayoutAxis directions[]{{"x", "dx_mm", &Vec2::x_m, Axis::x},
                                  {"y", "dy_mm", &Vec2::y_m, Axis::y}};

/// The rig with unlimited travel.
RigLimits without_ends(RigLimits limits) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  limits.geometry.travel.fill({-inf, inf});
  return limits;
}

/// Contact points within the travel of the stage. With the rotary stages at the level angles, which
/// shift and foreshorten it, the stage position is still linear in the point: two points determine
/// it.
Range reached(const RigLimits& limits, const LayoutAxis& direction) {
  const RigLimits free = without_ends(limits);
  Vec2 far;
  far.*direction.part = limits.geometry.plate_size_m.*direction.part;
  const double from = over(free, {}, limits.clearance_m).value()[direction.axis];
  const double to = over(free, far, limits.clearance_m).value()[direction.axis];
  const double slope = (to - from) / (far.*direction.part);
  const auto point = [&](double stage) { return (stage - from) / slope; };
  const Range& travel = limits.geometry.travel[index(direction.axis)];
  return {point(travel.min), point(travel.max)};
}

/// Range of the contact point along one direction of the fabric frame.
Range allowed(const RigLimits& limits, const LayoutAxis& direction) {
  const double half_face = limits.footprint_m.*direction.part / 2;
  const double size = limits.geometry.plate_size_m.*direction.part;
  const Range by_travel = reached(limits, direction);
  return {std::max(half_face, by_travel.min), std::min(size - half_face, by_travel.max)};
}

/// Extent of the path relative to its start.
Range extent(const std::vector<Vec2>& path, const LayoutAxis& direction) {
  Range range;
  for (const Vec2& corner : path) {
    range.min = std::min(range.min, corner.*direction.part);
    range.max = std::max(range.max, corner.*direction.part);
  }
  return range;
}

std::string room_hint(const Range& room) {
  return "Keep the face of the probe on the plate and the stage within its travel: " +
         mm(room.min) + " to " + mm(room.max);
}

/// False, with a problem, if the path moves along an axis without a stage.
bool check_stage(const LayoutAxis& direction, const RigLimits& limits, const Range& path,
                 const StatedExploration& stated, Problems& problems) {
  if (!limits.geometry.is_fixed(direction.axis) || path.width() <= 0) return true;
  problems.add({stated.path_pointer,
                std::string("path along ") + direction.name + ", where the rig has no stage",
                std::string(direction.key) + " 0 in every leg", mm(path.width()),
                "Use explorations along x only, or a rig with that stage"});
  return false;
}

/// Centres the path in the available range; true when it fits.
bool check_centred(const LayoutAxis& direction, const Range& room, const Range& path,
                   StatedExploration& stated, Problems& problems) {
  stated.exploration.start_m.*direction.part = (room.min + room.max - path.min - path.max) / 2;
  if (path.width() <= room.width() + travel_rounding) return true;
  problems.add({stated.path_pointer, std::string("path too long along ") + direction.name,
                "at most " + mm(std::max(0.0, room.width())), mm(path.width()), room_hint(room)});
  return false;
}

/// True when the path stays in the available range.
bool check_start(const LayoutAxis& direction, const Range& room, const Range& path,
                 const StatedExploration& stated, Problems& problems) {
  const double start = stated.exploration.start_m.*direction.part;
  const Range reached{start + path.min, start + path.max};
  if (within(room, reached)) return true;
  problems.add({stated.path_pointer,
                std::string("path outside the plate or the travel along ") + direction.name,
                mm(room.min) + " to " + mm(room.max), mm(reached.min) + " to " + mm(reached.max),
                "Move its start or shorten " + std::string(direction.key)});
  return false;
}

/// A press by depth keeps its z, while the plate may rise under the probe. `by_turn_m`: rise caused
/// by the rotary stages; the tilt of the plate about the weft is added.
void check_level(const StatedExploration& stated, const RigLimits& limits, double by_turn_m,
                 Problems& problems) {
  constexpr double most_rise_m = 50e-6;
  const Exploration& exploration = stated.exploration;
  Range along_warp{0, 0};
  for (const Vec2& corner : exploration.path_m())
    along_warp = {std::min(along_warp.min, corner.x_m), std::max(along_warp.max, corner.x_m)};
  const double rise_m = by_turn_m + std::tan(std::abs(limits.level.ry_rad)) * along_warp.width();
  if (rise_m <= most_rise_m) return;
  problems.add({stated.path_pointer, "plate too tilted along the path for a press by depth",
                "at most " + mm(most_rise_m) + " of rise", mm(rise_m),
                "Level the plate or shorten the path"});
}

/// With the rotary stages at the level angles, z follows the plate along the path.
void check_height(const StatedExploration& stated, const RigLimits& limits, Problems& problems) {
  const RigLimits free = without_ends(limits);
  const Exploration& exploration = stated.exploration;
  const auto z_over = [&](Vec2 point) {
    return over(free, point, limits.clearance_m).value()[Axis::z];
  };
  const double start_z = z_over(exploration.start_m);
  Range used{start_z, start_z};
  for (std::size_t i = 0; i < exploration.path_m().size(); ++i) {
    const double z = z_over(path_leg(exploration, i).to_m);
    used = {std::min(used.min, z), std::max(used.max, z)};
  }
  const Range& travel = limits.geometry.travel[index(Axis::z)];
  if (!limits.has_wrench) check_level(stated, limits, used.width(), problems);
  if (within(travel, used)) return;
  problems.add({stated.path_pointer, "path outside the travel of z at the plate tilt of the rig",
                mm(travel.min) + " to " + mm(travel.max), mm(used.min) + " to " + mm(used.max),
                "Move its start, or level the plate by hand first"});
}

constexpr const char* for_analysis = "weft design analyse leaves it out";

std::size_t samples(double seconds, double rate_hz) {
  return static_cast<std::size_t>(seconds * rate_hz);
}

/// Reports the cell of an exploration with the shortest phase, if it is too short.
void check_phase(const Plan& plan, std::size_t exploration, Phase phase, std::size_t least,
                 std::vector<Diagnostic>& out) {
  const std::size_t cells = plan.sweep->cells.size();
  const auto first = plan.explorations.begin() + static_cast<std::ptrdiff_t>(exploration * cells);
  const auto shortest =
      std::min_element(first, first + static_cast<std::ptrdiff_t>(cells),
                       [&](const Exploration& a, const Exploration& b) {
                         return a.step(phase).duration_s < b.step(phase).duration_s;
                       });
  const std::size_t got = samples(shortest->step(phase).duration_s, plan.limits.taxel_rate_hz);
  if (got < least)
    out.push_back(
        {child("/explorations", plan.sweep->explorations[exploration]),
         std::string("too few samples in phase ") + to_char(phase) + ", so " + for_analysis,
         "at least " + std::to_string(least) + " in every cell",
         std::to_string(got) + " in " + shortest->name,
         phase == Phase::motion ? "Use a longer path or a lower speed" : "Make the phase longer"});
}

}  // namespace

void spread_sweep(StatedRecipe& stated, const RigLimits& limits, Problems& problems) {
  if (!stated.sweep) return;
  Sweep& sweep = *stated.sweep;
  std::vector<StatedExploration> spread;
  std::set<std::string> reported;  // a stroke that is too long is reported once, not in every cell
  for (const StatedExploration& base : stated.explorations) {
    sweep.explorations.push_back(base.exploration.name);
    for (const std::vector<std::size_t>& cell : sweep.cells) {
      spread.push_back(in_cell(base, sweep, cell));
      Problems found;
      place_on_plate(spread.back(), limits, found);
      if (varies(sweep, FactorKind::stroke)) check_legs(spread.back(), found);
      if (!found.empty() && reported.insert(spread.back().path_pointer).second)
        for (Diagnostic& one : found.take()) problems.add(std::move(one));
    }
    check_names(base.pointer, std::span(spread).last(sweep.cells.size()), problems);
  }
  stated.explorations = std::move(spread);
}

Exploration at_first_values(const Exploration& exploration, const Sweep& sweep) {
  Exploration out = exploration;
  for (const Factor& factor : sweep.factors)
    if (factor.kind != FactorKind::direction) set(factor.kind, factor.values.front(), out);
  return out;
}

bool varies(const Sweep& sweep, FactorKind kind) {
  return std::ranges::any_of(sweep.factors, [&](const Factor& f) { return f.kind == kind; });
}

std::array<Range, 2> find_starts(const Exploration& exploration, const RigLimits& limits) {
  std::array<Range, 2> out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Range room = allowed(limits, directions[i]);
    const Range path = extent(exploration.path_m(), directions[i]);
    out[i] = {room.min - path.min, room.max - path.max};
  }
  return out;
}

void place_on_plate(StatedExploration& stated, const RigLimits& limits, Problems& problems) {
  if (stated.path_pointer.empty()) return;  // already refused
  Exploration& exploration = stated.exploration;
  if (stated.start_m) exploration.start_m = *stated.start_m;
  const std::vector<Vec2>& corners = exploration.path_m();
  bool fits = true;
  for (const LayoutAxis& direction : directions) {
    const Range room = allowed(limits, direction);
    const Range path = extent(corners, direction);
    if (!check_stage(direction, limits, path, stated, problems)) {
      fits = false;
      continue;
    }
    fits &= stated.start_m ? check_start(direction, room, path, stated, problems)
                           : check_centred(direction, room, path, stated, problems);
  }
  if (fits) check_height(stated, limits, problems);  // outside the range z cannot be checked
}

std::vector<Diagnostic> warnings_about_sweep(const Plan& plan) {
  std::vector<Diagnostic> out;
  if (!plan.sweep) return out;
  if (plan.fabrics.size() < least_swept_fabrics)
    out.push_back({"/fabrics", "too few fabrics for weft design analyse",
                   "at least " + std::to_string(least_swept_fabrics),
                   std::to_string(plan.fabrics.size()), ""});
  if (plan.sweep->replicates < least_swept_replicates)
    out.push_back(
        {"/sweep/replicates", "too few replicates for weft design analyse",
         "at least " + std::to_string(least_swept_replicates),
         std::to_string(plan.sweep->replicates),
         "Raise replicates, or analyse it together with another sweep of the same cells"});
  const std::size_t cells = plan.sweep->cells.size();
  for (std::size_t e = 0; e < plan.sweep->explorations.size(); ++e) {
    if (!plan.explorations[e * cells].slides()) {
      out.push_back({child("/explorations", plan.sweep->explorations[e]),
                     std::string("press without phase M, so ") + for_analysis,
                     "an exploration with phase M", "", ""});
      continue;
    }
    check_phase(plan, e, Phase::press, least_press_samples, out);
    check_phase(plan, e, Phase::motion, least_motion_samples, out);
  }
  return out;
}

}  // namespace weft::recipes
