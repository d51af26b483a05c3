// The place of a repetition: piece of fabric, mounting and patch; declared in recipe_reader.hpp.

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "recipes/engine/draws.hpp"
#include "recipes/engine/recipe_reader.hpp"

namespace weft::recipes {
namespace {

using nlohmann::json;

constexpr std::int64_t most_pieces = 1000;

/// A number, or "never". `reader` reports anything else.
std::uint32_t read_remount(const json& repetition, ObjectReader& reader) {
  const auto found = repetition.find("remount_every");
  if (found != repetition.end() && found->is_string() && *found == "never") {
    reader.leave("remount_every");
    return 0;
  }
  return static_cast<std::uint32_t>(
      reader.integer("remount_every", 1, most_repetitions, Need::optional).value_or(0));
}

std::uint32_t read_pieces(ObjectReader& reader) {
  const auto piece = reader.choice("piece", {"one", "each_label_split"}, Need::optional);
  if (piece == 1)
    return static_cast<std::uint32_t>(
        reader.integer("pieces", 2, most_pieces, Need::optional).value_or(2));
  reader.explain("pieces", "pieces not allowed without \"piece\": \"each_label_split\"");
  return 1;
}

std::uint32_t repetitions_of(const StatedRecipe& stated) {
  return stated.sweep ? static_cast<std::uint32_t>(stated.sweep->replicates) : stated.repetitions;
}

/// Point `index` of the sequence R2 (Roberts 2018) in the unit square. Any number of points is
/// evenly spread. The first is the middle.
Vec2 spread_point(std::uint32_t index) {
  constexpr double plastic = 1.32471795724474602596;
  const auto part = [&](double step) {
    const double at = 0.5 + step * index;
    return at - std::floor(at);
  };
  return {part(1 / plastic), part(1 / (plastic * plastic))};
}

/// Offset from the exploration's own start, which is the first patch.
Vec2 offset_of(const Exploration& exploration, const std::array<Range, 2>& starts,
               std::uint32_t patch) {
  if (patch == 1) return {};
  const Vec2 share = spread_point(patch - 1);
  return {starts[0].min + share.x_m * starts[0].width() - exploration.start_m.x_m,
          starts[1].min + share.y_m * starts[1].width() - exploration.start_m.y_m};
}

std::uint64_t level_seed(const char* level, std::uint64_t seed, const std::string& fabric,
                         std::uint32_t number) {
  std::string key = level;
  for (const std::string& part : {std::to_string(seed), fabric, std::to_string(number)})
    (key += '/') += part;
  return seed_of(key);
}

std::string square_mm(double x_m, double y_m) {
  const auto mm = [](double metres) { return std::to_string(std::lround(metres * 1e3)); };
  return mm(x_m) + " x " + mm(y_m) + " mm";
}

}  // namespace

void read_repetition(const json& document, ObjectReader& recipe, StatedRecipe& stated) {
  std::optional<ObjectReader> reader = recipe.section("repetition");
  if (!reader) return;
  Repetition& out = stated.repetition;
  const auto path = reader->choice("path", {"same", "new_patch"}, Need::optional);
  out.path = path == 1 ? Repetition::Path::new_patch : Repetition::Path::same;
  const json& object = document.at("repetition");
  out.remount_every = object.is_object() ? read_remount(object, *reader) : 0;
  out.pieces = read_pieces(*reader);
  reader->finish();
}

std::uint32_t piece_of(std::uint32_t repetition, std::uint32_t repetitions, std::uint32_t pieces) {
  return 1 + static_cast<std::uint32_t>((std::uint64_t{repetition} - 1) * pieces / repetitions);
}

void check_repetition(const StatedRecipe& stated, const RigLimits& limits, Problems& problems) {
  const Repetition& repetition = stated.repetition;
  if (repetition == Repetition{}) return;
  if (limits.imprint_array)
    problems.add(
        {"/repetition",
         "repetition not allowed with an imprint array: objects have no pieces and patches",
         "no \"repetition\" on this rig", "", ""});
  const std::uint32_t repetitions = repetitions_of(stated);
  if (repetition.pieces > repetitions)
    problems.add({"/repetition/pieces", "more pieces than repetitions",
                  "at most " + std::to_string(repetitions), std::to_string(repetition.pieces), ""});
  if (repetition.path == Repetition::Path::same || repetitions == 1) return;
  for (const StatedExploration& e : stated.explorations) {
    const auto [x, y] = find_starts(e.exploration, limits);
    if (x.width() >= limits.footprint_m.x_m || y.width() >= limits.footprint_m.y_m) continue;
    const Vec2 plate = limits.geometry.plate_size_m;
    problems.add(
        {"/repetition/path", "plate too small for a second patch",
         "more than " +
             square_mm(plate.x_m - std::max(0.0, x.width()), plate.y_m - std::max(0.0, y.width())) +
             ", the size of path and face of " + e.exploration.name,
         square_mm(plate.x_m, plate.y_m), "Shorten the path"});
  }
}

void assign_places(const StatedRecipe& stated, const RigLimits& limits,
                   std::vector<TrialSpec>& trials) {
  const Repetition& repetition = stated.repetition;
  const std::uint32_t repetitions = repetitions_of(stated);
  std::vector<std::array<Range, 2>> starts;
  for (const StatedExploration& e : stated.explorations)
    starts.push_back(find_starts(e.exploration, limits));
  std::map<std::size_t, std::uint32_t> mountings;  // of each fabric so far
  std::uint32_t touches = 0;                       // trials of the mounting so far
  const TrialSpec* before = nullptr;
  for (TrialSpec& trial : trials) {
    TrialPlace& place = trial.place;
    place.piece = piece_of(trial.repetition, repetitions, repetition.pieces);
    const bool changes = before == nullptr || before->fabric != trial.fabric ||
                         before->place.piece != place.piece ||
                         (repetition.remount_every > 0 && touches >= repetition.remount_every);
    if (changes) touches = 0;
    place.mounting = changes ? ++mountings[trial.fabric] : mountings[trial.fabric];
    ++touches;
    if (repetition.path == Repetition::Path::new_patch) place.patch = trial.repetition;
    const Exploration& exploration = stated.explorations[trial.exploration].exploration;
    place.offset_m = offset_of(exploration, starts[trial.exploration], place.patch);
    const std::string& fabric = stated.fabrics[trial.fabric];
    trial.seeds = {level_seed("piece", stated.seed, fabric, place.piece),
                   level_seed("mounting", stated.seed, fabric, place.mounting),
                   patch_seed(stated.seed, fabric, exploration.name, trial.repetition)};
    before = &trial;
  }
}

namespace {

/// Least distance between patches of one exploration [m], for the first thousand patches.
double nearest_patches_m(const Plan& plan, std::size_t exploration) {
  constexpr std::size_t most = 1000;
  std::map<std::uint32_t, Vec2> patches;
  for (const TrialSpec& trial : plan.trials)
    if (trial.exploration == exploration && patches.size() < most)
      patches[trial.place.patch] = trial.place.offset_m;
  double nearest_m = HUGE_VAL;
  for (auto a = patches.begin(); a != patches.end(); ++a)
    for (auto b = std::next(a); b != patches.end(); ++b)
      nearest_m = std::min(
          nearest_m, std::hypot(a->second.x_m - b->second.x_m, a->second.y_m - b->second.y_m));
  return nearest_m;
}

}  // namespace

std::vector<Diagnostic> warnings_about_places(const Plan& plan) {
  std::vector<Diagnostic> out;
  const Repetition& repetition = plan.repetition;
  const double face_m = std::max(plan.limits.footprint_m.x_m, plan.limits.footprint_m.y_m);
  for (std::size_t e = 0;
       repetition.path == Repetition::Path::new_patch && e < plan.explorations.size(); ++e) {
    const double nearest_m = nearest_patches_m(plan, e);
    if (nearest_m < face_m)
      out.push_back(
          {"/repetition/path", "patches of " + plan.explorations[e].name + " overlap",
           "starts at least " + json(face_m * 1e3).dump() + " mm apart, the size of the face",
           json(std::round(nearest_m * 1e4) / 10).dump() + " mm",
           "Use fewer repetitions or a shorter path"});
  }
  const auto most = std::ranges::max_element(
      plan.trials, {}, [](const TrialSpec& trial) { return trial.place.mounting; });
  const std::uint32_t mountings = most->place.mounting;
  if (repetition.remount_every > 0 && mountings == 1)
    out.push_back({"/repetition/remount_every",
                   "remount_every without effect: too few trials of one fabric in a row", "", "",
                   "Lower remount_every or remove it"});
  if (repetition.remount_every == 0 && mountings > repetition.pieces)
    out.push_back({"/order", "fabric mounted several times by the order of trials",
                   "once, as for \"remount_every\": \"never\"",
                   std::to_string(mountings) + " times",
                   "Use a blocked order to keep the trials of a fabric together"});
  return out;
}

}  // namespace weft::recipes
