#include "recipes/engine/sweep_cells.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include "recipes/engine/layout.hpp"

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

void set(FactorKind kind, double value, Exploration& exploration) {
  for (PhaseStep& step : exploration.phases) {
    const bool motion = step.phase == Phase::motion, press = step.phase == Phase::press;
    if (kind == FactorKind::force && (motion || press)) step.force_n = value;
    if (kind == FactorKind::speed && motion) step.speed_mps = value;
    if (kind == FactorKind::press && press) step.duration_s = value;
    if (kind != FactorKind::stroke || !motion) continue;
    const double scale = value / length_m(step.path_m);
    for (Vec2& corner : step.path_m) corner = {corner.x_m * scale, corner.y_m * scale};
  }
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
    if (factor.kind == FactorKind::stroke) out.path_pointer = factor.pointers[cell[i]];
  }
  return out;
}

/// Of a path that a stroke has scaled.
double shortest_leg_m(const Exploration& exploration) {
  double shortest = HUGE_VAL;
  Vec2 from;
  for (const Vec2& to : exploration.path_m()) {
    shortest = std::min(shortest, std::hypot(to.x_m - from.x_m, to.y_m - from.y_m));
    from = to;
  }
  return shortest;
}

/// A stroke keeps the path's shape, so that its shortest leg may come to nothing.
void check_legs(const StatedExploration& stated, Problems& problems) {
  const double shortest = shortest_leg_m(stated.exploration);
  if (shortest >= least_leg_m) return;
  problems.add({stated.path_pointer, "the stroke makes a leg of the path that leads nowhere",
                "legs of at least 0.001 mm",
                nlohmann::json(shortest * 1e3).dump() + " mm in " + stated.exploration.name,
                "take a longer stroke, or leave the short leg out"});
}

/// The longest name among the cells of one exploration is told, once.
void check_names(const std::string& pointer, std::span<const StatedExploration> cells,
                 Problems& problems) {
  const auto longest = std::ranges::max_element(
      cells, {}, [](const StatedExploration& cell) { return cell.exploration.name.size(); });
  const std::string& name = longest->exploration.name;
  if (name.size() > longest_name)
    problems.add({pointer, "the exploration's name is too long for the names of its cells",
                  "at most 64 bytes with its values", name, "shorten the name"});
}

}  // namespace

void spread_sweep(StatedRecipe& stated, const RigLimits& limits, Problems& problems) {
  if (!stated.sweep) return;
  Sweep& sweep = *stated.sweep;
  std::vector<StatedExploration> spread;
  std::set<std::string> reported;  // a stroke that is too long is told once, not in every cell
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
  for (const Factor& factor : sweep.factors) set(factor.kind, factor.values.front(), out);
  return out;
}

bool varies(const Sweep& sweep, FactorKind kind) {
  return std::ranges::any_of(sweep.factors, [&](const Factor& f) { return f.kind == kind; });
}

}  // namespace weft::recipes
