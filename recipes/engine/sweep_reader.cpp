// Reads the sweep of a recipe; declared in recipe_reader.hpp.

#include "protocols/base/closest.hpp"
#include "recipes/engine/recipe_reader.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "recipes/engine/sweep.hpp"
#include "recipes/schema/quantities.hpp"

namespace weft::recipes {
namespace {

using nlohmann::json;

/// More combinations are no pilot study, and each is an exploration in memory. The time to choose a
/// fraction grows with the square.
constexpr std::uint64_t most_cells = 10'000, most_cells_to_choose_from = 2'000;
constexpr double least_stroke_m = 1e-6, longest_stroke_m = 10;
constexpr double least_press_s = 0.1, longest_press_s = 3600;
constexpr double full_turn_rad = 2 * std::numbers::pi;

struct KindReader {
  FactorKind kind;
  Quantity quantity;
};

const std::vector<KindReader>& kind_readers() {
  static const std::vector<KindReader> readers{
      {FactorKind::force, quantities::force},
      {FactorKind::speed, quantities::speed},
      {FactorKind::press, {"press", {{"press_s", 1}}}},
      {FactorKind::stroke, {"stroke", {{"stroke_mm", quantities::mm_per_m}, {"stroke_m", 1}}}},
      {FactorKind::direction,
       {"direction", {{"direction_deg", quantities::deg_per_rad}, {"direction_rad", 1}}}}};
  return readers;
}

std::vector<std::string_view> spelled_names() {
  std::vector<std::string_view> out;
  for (const KindReader& reader : kind_readers())
    for (const Spelling& spelling : reader.quantity.spellings) out.push_back(spelling.key);
  return out;
}

/// A factor with the spelling of the recipe.
struct Spelled {
  FactorKind kind = FactorKind::force;
  Spelling spelling;
};

std::optional<Spelled> spelled(std::string_view name) {
  for (const KindReader& reader : kind_readers())
    for (const Spelling& spelling : reader.quantity.spellings)
      if (spelling.key == name) return Spelled{reader.kind, spelling};
  return std::nullopt;
}

/// Limits of the rig for one factor, over all explorations, in SI.
Bounds bounds_of(FactorKind kind, const RigLimits& limits) {
  switch (kind) {
    case FactorKind::force:
      return {limits.least_force_n(), limits.force_cap_n, force_bounds_reason};
    case FactorKind::speed:
      return {least_speed_mps, limits.max_speed_mps, "the limit of the rig"};
    case FactorKind::press:
      return {least_press_s, longest_press_s, {}};
    case FactorKind::stroke:
      return {least_stroke_m, longest_stroke_m, {}};
    case FactorKind::direction:
      return {-full_turn_rad, full_turn_rad, {}};
  }
  return {};
}

/// The same direction from 0 to below a full turn; the six digits of a cell's name decide whether
/// it is 0.
double within_turn(double rad) {
  if (rad == 0) return 0;  // also -0, which would be named "-0deg"
  const double turned = rad < 0 ? rad + full_turn_rad : rad;
  const std::string name = format_factor(FactorKind::direction, turned);
  return name == format_factor(FactorKind::direction, full_turn_rad) ? 0 : turned;
}

double widest_band_n(const StatedRecipe& stated) {
  double widest = 0;
  for (const StatedExploration& e : stated.explorations)
    for (const PhaseStep& step : e.exploration.phases) widest = std::max(widest, step.force_band_n);
  return widest;
}

class SweepReader {
 public:
  SweepReader(const RigLimits& limits, StatedRecipe& stated, Problems& problems)
      : limits_(limits), stated_(stated), sweep_(stated.sweep.emplace()), problems_(problems) {}

  void read(const json& value, const std::string& place) {
    ObjectReader reader(value, place, problems_);
    if (const json* factors = reader.array("factors")) read_factors(*factors, reader.at("factors"));
    read_design(reader, value);
    sweep_.replicates =
        static_cast<std::uint32_t>(reader.integer("replicates", 1, most_repetitions).value_or(1));
    sweep_.randomised = reader.choice("order", {"randomised", "as_listed"}, Need::optional) != 1;
    const auto seed = reader.integer("seed", 0, largest_seed, Need::optional);
    sweep_.seed = seed ? static_cast<std::uint64_t>(*seed) : stated_.seed;
    if (!sweep_.randomised) reader.explain("seed", "seed not allowed in an order as listed");
    const auto block = reader.choice("block_by", {"fabric", "replicate", "none"}, Need::optional);
    sweep_.block_by = static_cast<BlockBy>(block.value_or(0));
    reader.finish();
    if (problems_.empty()) choose_cells(place);
  }

 private:
  void read_factors(const json& list, const std::string& place) {
    if (list.empty())
      return problems_.add({place, "list of factors empty", "at least one", "0",
                            "Choose from " + one_of(spelled_names())});
    if (list.size() > kind_readers().size())
      return problems_.add({place, "too many factors",
                            "at most " + std::to_string(kind_readers().size()) + ", each once",
                            std::to_string(list.size()), "Choose from " + one_of(spelled_names())});
    for (std::size_t i = 0; i < list.size(); ++i) read_factor(list[i], child(place, i));
  }

  void read_factor(const json& value, const std::string& place) {
    ObjectReader reader(value, place, problems_);
    const auto name = reader.text("name");
    const json* values = reader.array("values");
    reader.finish();
    if (!name) return;
    const auto known = spelled(*name);
    if (!known) return unknown_factor(*name, reader.at("name"));
    const auto same = [&](const Factor& other) { return other.kind == known->kind; };
    if (std::ranges::any_of(sweep_.factors, same))
      problems_.add({reader.at("name"), "factor given twice", "every factor once", *name,
                     "Put all its values into one list"});
    if (known->kind == FactorKind::speed || known->kind == FactorKind::stroke ||
        known->kind == FactorKind::direction)
      refuse_presses(reader.at("name"), *name);
    Factor factor{known->kind, {}, {}};
    if (values != nullptr) read_values(*values, reader.at("values"), *known, factor);
    sweep_.factors.push_back(std::move(factor));
  }

  void unknown_factor(const std::string& name, std::string place) {
    problems_.add(
        {std::move(place), "factor unknown", "", clipped(name),
         did_you_mean(name, spelled_names(), "Known factors are " + one_of(spelled_names()))});
  }

  void refuse_presses(const std::string& place, const std::string& name) {
    for (const StatedExploration& e : stated_.explorations)
      if (!e.exploration.phases.empty() && !e.exploration.slides())
        problems_.add({place, "factor " + name + " not allowed with a press",
                       "explorations with phase M", e.exploration.name, ""});
  }

  void read_values(const json& list, const std::string& place, const Spelled& known,
                   Factor& factor) {
    if (list.empty())
      return problems_.add({place, "factor without values", "at least one", "0",
                            "Remove the factor, or give it values"});
    if (list.size() > most_cells)
      return problems_.add({place, "too many values of a factor",
                            "at most " + std::to_string(most_cells), std::to_string(list.size()),
                            "Give fewer values"});
    std::set<std::string> seen;  // by cell name: two values with one name would be one cell
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string at = child(place, i);
      const auto si = read_value(list[i], at, known);
      if (!si) continue;
      if (!seen.insert(format_factor(known.kind, *si)).second) {
        const bool turns = known.kind == FactorKind::direction;
        problems_.add({at, turns ? "direction listed twice" : "value listed twice",
                       turns ? "every direction once, modulo 360 deg" : "every value once",
                       brief(list[i]), "Use \"replicates\" to repeat every cell"});
        continue;
      }
      factor.values.push_back(*si);
      factor.pointers.push_back(at);
    }
  }

  std::optional<double> read_value(const json& value, const std::string& place,
                                   const Spelled& known) {
    if (!value.is_number()) {
      problems_.add({place, "value has the wrong type", "a number", brief(value), ""});
      return std::nullopt;
    }
    if (known.kind == FactorKind::force && !limits_.has_wrench) {
      problems_.add({place, "force not allowed as a factor on a rig without a force sensor",
                     "another factor", brief(value), ""});
      return std::nullopt;
    }
    const double si = value.get<double>() / known.spelling.per_si;
    const Bounds bounds = bounds_of(known.kind, limits_);
    if (!std::isfinite(si) || si < bounds.min || si > bounds.max) {
      problems_.add({place, "value of the factor out of range", range_text(bounds, known.spelling),
                     brief(value), ""});
      return std::nullopt;
    }
    const double top_n = si + widest_band_n(stated_);
    if (known.kind == FactorKind::force && top_n > limits_.force_cap_n) {
      problems_.add({place, "sum of force and band above the cap",
                     "at most " + json(limits_.force_cap_n).dump() + " N",
                     json(top_n).dump() + " N", "Lower the force or force_band_N"});
      return std::nullopt;
    }
    return known.kind == FactorKind::direction ? within_turn(si) : si;
  }

  void read_design(ObjectReader& reader, const json& sweep) {
    if (!reader.has("design")) return;
    reader.leave("design");
    const json& design = sweep.at("design");
    const std::string place = reader.at("design");
    if (design == "full") return;
    if (!design.is_object())
      return problems_.add(
          {place, "design unknown", R"("full" or {"cell_fraction": 0.5})", brief(design), ""});
    ObjectReader parts(design, place, problems_);
    Fraction fraction;
    fraction.share =
        parts
            .quantity({"cell_fraction", {{"cell_fraction", 1}}}, {0.001, 1, "a share of the cells"})
            .value_or(1);
    if (parts.choice("model", {"quadratic", "linear"}, Need::optional) == 1)
      fraction.model = SweepModel::linear;
    parts.finish();
    refuse_periodic(place);
    sweep_.fraction = fraction;
  }

  /// A polynomial has different values at 0 and 360 deg, so it cannot choose among directions.
  void refuse_periodic(const std::string& place) {
    if (varies(sweep_, FactorKind::direction))
      problems_.add({place, "fraction not allowed with directions, which are periodic",
                     "design \"full\"", "", "Give fewer directions, or remove \"design\""});
  }

  /// All factors are valid here.
  void choose_cells(const std::string& place) {
    if (!check_counts(place)) return;
    std::vector<std::vector<std::size_t>> all{{}};
    for (const Factor& factor : sweep_.factors) {
      std::vector<std::vector<std::size_t>> longer;
      for (const auto& cell : all)
        for (std::size_t level = 0; level < factor.values.size(); ++level) {
          longer.push_back(cell);
          longer.back().push_back(level);
        }
      all = std::move(longer);
    }
    if (!sweep_.fraction) {
      sweep_.cells = std::move(all);
      return;
    }
    const auto rows = model_rows(sweep_.factors, sweep_.fraction->model);
    const std::size_t count = count_cells();
    if (count < rows.front().size())
      return problems_.add({place + "/design/cell_fraction", "too few cells for the model",
                            "at least " + std::to_string(rows.front().size()) + " cells",
                            std::to_string(count) + " of " + std::to_string(all.size()),
                            "Raise the fraction, or set \"model\" to \"linear\""});
    const Subset subset = d_optimal(rows, count);
    sweep_.d_efficiency = subset.d_efficiency;
    for (const std::size_t row : subset.rows) sweep_.cells.push_back(all[row]);
  }

  [[nodiscard]] std::size_t count_cells() const {
    const auto all = static_cast<double>(sweep_.full_cells());
    const double share = sweep_.fraction ? sweep_.fraction->share : 1;
    return static_cast<std::size_t>(std::llround(share * all));
  }

  bool check_counts(const std::string& place) {
    const double trials =
        static_cast<double>(stated_.fabrics.size()) *
        static_cast<double>(stated_.explorations.size()) * sweep_.replicates *
        static_cast<double>(sweep_.fraction ? count_cells() : sweep_.full_cells());
    if (trials > static_cast<double>(max_trials)) {
      problems_.add({place, "too many trials in the sweep", "at most " + std::to_string(max_trials),
                     json(trials).dump(),
                     "Give fewer values, fewer replicates or a fraction of the design"});
      return false;
    }
    const std::uint64_t most = sweep_.fraction ? most_cells_to_choose_from : most_cells;
    if (sweep_.full_cells() > most) {
      problems_.add({place, "too many combinations of factors", "at most " + std::to_string(most),
                     std::to_string(sweep_.full_cells()), "Give fewer values"});
      return false;
    }
    const std::uint64_t cells = sweep_.fraction ? count_cells() : sweep_.full_cells();
    const std::uint64_t explorations = stated_.explorations.size() * cells;
    if (explorations <= most_cells) return true;
    problems_.add({place, "too many cells of all explorations",
                   "at most " + std::to_string(most_cells),
                   std::to_string(stated_.explorations.size()) + " explorations in " +
                       std::to_string(cells) + " cells: " + std::to_string(explorations),
                   "Give fewer values, or sweep one exploration at a time"});
    return false;
  }

  const RigLimits& limits_;
  StatedRecipe& stated_;
  Sweep& sweep_;
  Problems& problems_;
};

}  // namespace

void read_sweep(ObjectReader& recipe, const RigLimits& limits, StatedRecipe& stated,
                Problems& problems) {
  const json* value = recipe.object("sweep", Need::optional);
  if (value == nullptr) return;
  recipe.explain("order", "order not allowed beside a sweep; the order inside \"sweep\" is used");
  recipe.explain("hand_over", "handover not allowed for a sweep; weft design analyse evaluates it");
  SweepReader(limits, stated, problems).read(*value, recipe.at("sweep"));
  stated.repetitions = stated.sweep->replicates;
}

}  // namespace weft::recipes
