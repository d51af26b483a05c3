#include "daemon/analysis/design/sweep_analysis.hpp"

#include <algorithm>
#include <set>

#include "daemon/base/text/format.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {
namespace {

constexpr double ns_per_s = 1e9;

tl::unexpected<Error> apart(std::string message, const DatasetInfo& info, std::string expected,
                            std::string got) {
  return fail({.code = Errc::invalid_argument,
               .where = info.name,
               .what = std::move(message),
               .expected = std::move(expected),
               .got = std::move(got),
               .hint = "Analyse the data sets separately"});
}

std::string format_swept_rig(const recipes::RigLimits& rig) {
  return rig.name + ", " + rig.bench + ", " + std::to_string(rig.taxels) + " taxels";
}

Result<recipes::RigLimits> swept_rig(const DatasetInfo& info) {
  auto limits = recipes::parse_rig_limits(info.rig_json);
  if (!limits) return pass(limits.error(), info.name + ": rig on record");
  return limits;
}

Status check_sweep(const DatasetInfo& info) {
  if (!info.factors.empty()) return {};
  return fail({.code = Errc::invalid_argument,
               .where = info.name,
               .what = "data set without sweep",
               .expected = "a recipe with \"sweep\"",
               .hint = "Add a sweep to the recipe; see docs/howto/choose-settings.md"});
}

/// Different sensors respond differently, so their cells cannot be combined.
Status check_alike(const DatasetInfo& first, const DatasetInfo& info) {
  if (info.kind != first.kind)
    return apart("simulated and real data mixed", info, std::string(to_string(first.kind)),
                 std::string(to_string(info.kind)));
  if (info.kind == BenchKind::unknown)
    return apart("data of an unknown bench", info, "simulated or real", "unknown");
  if (info.factors != first.factors)
    return apart("sweeps with different factors", info, joined(first.factors),
                 joined(info.factors));
  if (info.taxel_rate_hz != first.taxel_rate_hz)
    return apart("sweeps with different sample rates", info, general(first.taxel_rate_hz) + " Hz",
                 general(info.taxel_rate_hz) + " Hz");
  const auto one = swept_rig(first), other = swept_rig(info);
  if (!one) return pass(one.error());
  if (!other) return pass(other.error());
  if (format_swept_rig(*one) != format_swept_rig(*other))
    return apart("sweeps with different rigs", info, format_swept_rig(*one),
                 format_swept_rig(*other));
  if (info.devices != first.devices)
    return apart("sweeps with different devices or device scales", info, "the same devices", {});
  return {};
}

Result<recipes::Plan> swept_plan(const DatasetInfo& info) {
  const auto limits = swept_rig(info);
  if (!limits) return pass(limits.error());
  recipes::CheckReport report = recipes::check_recipe(info.recipe_json, *limits);
  if (!report.plan)
    return fail({.code = Errc::invalid_argument,
                 .where = info.name + ": recipe on record",
                 .what = recipes::to_string(report.problems.front())});
  if (!report.plan->sweep)
    return fail({.code = Errc::corrupt,
                 .where = info.name,
                 .what = "recorded recipe has factors but no sweep"});
  return *std::move(report.plan);
}

double swept_seconds(const TrialRecord& record) {
  if (record.t_ns.size() < 2) return 0;
  return static_cast<double>(record.t_ns.back() - record.t_ns.front()) / ns_per_s;
}

/// Cells by their exploration's name; two spellings of a value share one.
using ByName = std::map<std::string, CellTrials>;

/// Adds the cells that a data set plans, with its complete trials.
Status add_cells(const Dataset& dataset, std::size_t number, std::map<std::string, ByName>& all) {
  const auto plan = swept_plan(dataset.info);
  if (!plan) return pass(plan.error());
  std::map<std::string, CellTrials*> cells;
  for (std::size_t e = 0; e < plan->explorations.size(); ++e) {
    const recipes::Exploration& exploration = plan->explorations[e];
    // each of the recipe's explorations is followed by all its cells
    const std::string& base = plan->sweep->explorations[e / plan->sweep->cells.size()];
    CellTrials& cell = all[base][exploration.name];
    cell.factors = exploration.factors;
    cell.speed_mps = exploration.slides() ? exploration.step(Phase::motion).speed_mps : 0;
    cells[exploration.name] = &cell;
  }
  const std::string prefix = std::to_string(number) + "/";
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const TrialRecord& record = dataset.records[i];
    if (record.outcome != TrialOutcome::complete) continue;
    const auto found = cells.find(record.spec.exploration);
    if (found == cells.end())
      return fail({.code = Errc::corrupt,
                   .where = dataset.trials[i].file,
                   .what = "trial of an exploration not in the recorded recipe",
                   .got = record.spec.exploration});
    CellTrials& cell = *found->second;
    classifier::Trial& trial = cell.trials.emplace_back(dataset.trials[i]);
    trial.group.insert(0, prefix);
    trial.file.insert(0, prefix);
    cell.seconds.push_back(swept_seconds(record));
  }
  return {};
}

struct Shape {
  std::map<std::string, std::size_t> trials;  ///< per fabric
  std::size_t replicates = 0;
  auto operator<=>(const Shape&) const = default;
  [[nodiscard]] std::size_t all() const {
    std::size_t sum = 0;
    for (const auto& [fabric, count] : trials) sum += count;
    return sum;
  }
};

Shape shape_of(const CellTrials& cell) {
  Shape out;
  std::set<std::string> groups;
  for (const classifier::Trial& trial : cell.trials) {
    ++out.trials[trial.label];
    groups.insert(trial.group);
  }
  out.replicates = groups.size();
  return out;
}

/// "wool in 2 trials instead of 3".
std::string format_shape(const Shape& usual, const Shape& shape) {
  std::set<std::string> fabrics;
  for (const Shape* one : {&usual, &shape})
    for (const auto& [fabric, count] : one->trials) fabrics.insert(fabric);
  const auto count = [](const Shape& of, const std::string& fabric) {
    const auto found = of.trials.find(fabric);
    return found == of.trials.end() ? 0 : found->second;
  };
  std::vector<std::string> out;
  for (const std::string& fabric : fabrics)
    if (count(usual, fabric) != count(shape, fabric))
      out.push_back(fabric + " in " + std::to_string(count(shape, fabric)) + " trials instead of " +
                    std::to_string(count(usual, fabric)));
  if (usual.replicates != shape.replicates)
    out.push_back(std::to_string(shape.replicates) + " replicates instead of " +
                  std::to_string(usual.replicates));
  return joined(out);
}

}  // namespace

Result<SweptCells> swept_cells(std::span<const Dataset> datasets) {
  if (datasets.empty())
    return fail(
        {.code = Errc::invalid_argument, .where = "design analyse", .what = "no data set given"});
  for (const Dataset& dataset : datasets)
    if (Status ok = check_sweep(dataset.info); !ok) return pass(ok.error());
  for (const Dataset& dataset : datasets.subspan(1))
    if (Status ok = check_alike(datasets.front().info, dataset.info); !ok) return pass(ok.error());
  std::map<std::string, ByName> all;
  for (std::size_t i = 0; i < datasets.size(); ++i)
    if (Status ok = add_cells(datasets[i], i, all); !ok) return pass(ok.error());
  SweptCells out;
  for (auto& [exploration, by_name] : all) {
    std::vector<CellTrials>& cells = out[exploration];
    for (auto& [name, cell] : by_name) cells.push_back(std::move(cell));
    std::ranges::sort(cells, {}, &CellTrials::factors);
  }
  return out;
}

std::map<std::size_t, std::string> not_alike(std::span<const CellTrials* const> cells) {
  std::map<Shape, std::size_t> counts;
  for (const CellTrials* cell : cells) ++counts[shape_of(*cell)];
  if (counts.size() < 2) return {};
  const auto usual = std::ranges::max_element(counts, {}, [](const auto& one) {
                       return std::pair(one.second, one.first.all());
                     })->first;
  std::map<std::size_t, std::string> out;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (const Shape shape = shape_of(*cells[i]); shape != usual)
      out[i] = "trials differ from most cells: " + format_shape(usual, shape);
  return out;
}

}  // namespace weft::daemon
