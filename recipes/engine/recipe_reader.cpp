#include "recipes/engine/recipe_reader.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "protocols/base/closest.hpp"
#include "recipes/schema/object_reader.hpp"
#include "recipes/schema/parameters.hpp"
#include "recipes/schema/quantities.hpp"

namespace weft::recipes {
namespace {

using nlohmann::json;

constexpr std::size_t most_fabrics = 1000;
constexpr std::size_t most_explorations = 16;
constexpr double longest_wait_s = 86'400;
constexpr std::int64_t most_retakes = 20;

void read_fabric(const json& value, const std::string& place, const RigLimits& limits,
                 std::vector<std::string>& fabrics, Problems& problems) {
  if (!value.is_string() || !is_name(value.get<std::string>()))
    return problems.add({place, "fabric name invalid", std::string(name_rule), brief(value), ""});
  const std::string name = value.get<std::string>();
  if (std::find(fabrics.begin(), fabrics.end(), name) != fabrics.end())
    return problems.add({place, "fabric listed twice", "every fabric once", name,
                         "Use \"repetitions\" to explore a fabric more often"});
  fabrics.push_back(name);
  const std::vector<std::string_view> known(limits.fabrics.begin(), limits.fabrics.end());
  if (known.empty() || std::find(known.begin(), known.end(), name) != known.end()) return;
  problems.add({place, "fabric not in the rig file", "", name,
                did_you_mean(name, known, "Known fabrics are " + one_of(known))});
}

void read_fabrics(ObjectReader& recipe, const RigLimits& limits, StatedRecipe& stated,
                  Problems& problems) {
  const json* list = recipe.array("fabrics");
  if (list == nullptr) return;
  const std::string place = recipe.at("fabrics");
  if (list->empty() || list->size() > most_fabrics)
    return problems.add({place, list->empty() ? "list of fabrics empty" : "too many fabrics",
                         "1 to " + std::to_string(most_fabrics), std::to_string(list->size()), ""});
  for (std::size_t i = 0; i < list->size(); ++i)
    read_fabric((*list)[i], child(place, i), limits, stated.fabrics, problems);
}

void read_order(ObjectReader& recipe, StatedRecipe& stated) {
  stated.order_seed = stated.seed;
  std::optional<ObjectReader> order = recipe.section("order");
  if (!order) return;
  const auto kind = order->choice("kind", {"blocked", "randomised"});
  stated.order = kind == 1 ? Order::randomised : Order::blocked;
  const auto seed = order->integer("seed", 0, largest_seed, Need::optional);
  if (seed) stated.order_seed = static_cast<std::uint64_t>(*seed);
  if (kind == 0) order->explain("seed", "seed not allowed in a blocked order");
  order->finish();
}

void read_approach(ObjectReader& recipe, const RigLimits& limits, StatedRecipe& stated) {
  Approach& approach = stated.approach;
  const double top = limits.max_speed_mps;
  approach.speed_mps = std::min(approach.speed_mps, top);
  approach.seat_speed_mps = std::min(approach.seat_speed_mps, top);
  approach.transfer_speed_mps = top;
  std::optional<ObjectReader> reader = recipe.section("approach");
  if (!reader) return;
  const Bounds speed{least_speed_mps, top, "the limit of the rig"};
  reader->set(approach.speed_mps, quantities::speed, speed);
  reader->set(approach.seat_speed_mps, quantities::seat_speed, speed);
  reader->set(approach.transfer_speed_mps, quantities::transfer_speed, speed);
  if (limits.has_wrench)
    reader->set(
        approach.contact_force_n, quantities::contact_force,
        {0.02, 0.8 * limits.probe_weight_n, "between sensor noise and the weight of the probe"});
  else
    for (const char* key : {"contact_force_N", "contact_force_n"})
      reader->explain(
          key,
          "contact force not allowed on a rig without a force sensor; probe.touch_counts is used");
  reader->finish();
}

void read_settle(ObjectReader& recipe, StatedRecipe& stated, Problems& problems) {
  std::optional<ObjectReader> reader = recipe.section("settle");
  if (!reader) return;
  Settle& settle = stated.settle;
  reader->set(settle.dwell_s, quantities::dwell, {0, 60, {}});
  reader->set(settle.timeout_s, quantities::timeout, {0.1, 600, {}});
  if (settle.timeout_s <= settle.dwell_s)
    problems.add({reader->pointer(), "timeout_s too short",
                  "above dwell_s, " + json(settle.dwell_s).dump() + " s",
                  json(settle.timeout_s).dump() + " s", ""});
  reader->finish();
}

void read_repeat_bad(ObjectReader& recipe, StatedRecipe& stated) {
  std::optional<ObjectReader> reader = recipe.section("repeat_bad");
  if (!reader) return;
  RepeatBad& bad = stated.repeat_bad.emplace();
  bad.at_most = static_cast<std::uint32_t>(reader->integer("at_most", 1, most_retakes).value_or(1));
  reader->set(bad.lost_fraction, quantities::lost, {0, 1, "a fraction"});
  reader->set(bad.saturated_fraction, quantities::saturated, {0, 1, "a fraction"});
  reader->set(bad.still_taxel_s, quantities::still_taxel,
              {0.5, 60, "good taxels can keep a value for up to 0.5 s"});
  reader->set(bad.force_in_band_fraction, quantities::force_in_band, {0, 1, "a fraction"});
  reader->finish();
}

void read_explorations(ObjectReader& recipe, const RigLimits& limits, StatedRecipe& stated,
                       Problems& problems) {
  const json* value = recipe.object("explorations");
  if (value == nullptr) return;
  const std::string place = recipe.at("explorations");
  if (value->empty() || value->size() > most_explorations)
    return problems.add({place, "number of explorations out of range",
                         "1 to " + std::to_string(most_explorations), std::to_string(value->size()),
                         ""});
  for (const auto& [name, exploration] : value->items()) {
    if (!is_name(name))
      problems.add({child(place, name), "exploration name not usable in file names",
                    std::string(name_rule), clipped(name), ""});
    stated.explorations.push_back(
        read_exploration(name, exploration, child(place, name), limits, problems));
  }
}

void read_scalars(ObjectReader& recipe, StatedRecipe& stated, Problems& problems) {
  recipe.integer("schema_version", 1, 1);
  for (const std::string_view key : {"$schema", "source", "description"})
    recipe.text(key, Need::optional);
  read_bound_parameters(recipe, problems);
  stated.name = recipe.name("name").value_or("");
  stated.seed = static_cast<std::uint64_t>(
      recipe.integer("seed", 0, largest_seed, Need::optional).value_or(1));
  if (recipe.has("sweep"))
    recipe.explain("repetitions", "repetitions not allowed with a sweep; \"replicates\" is used");
  else
    stated.repetitions =
        static_cast<std::uint32_t>(recipe.integer("repetitions", 1, most_repetitions).value_or(0));
  recipe.set(stated.mount_timeout_s, quantities::mount_timeout, {1, longest_wait_s, {}});
  const auto on_failure = recipe.choice("on_trial_failure", {"stop", "continue"}, Need::optional);
  stated.on_trial_failure = on_failure == 1 ? OnTrialFailure::carry_on : OnTrialFailure::stop;
}

/// Each class must keep at least two imprints when any one of its objects is held out.
void check_left_to_learn(const StatedRecipe& stated, Problems& problems) {
  const std::size_t of_an_object = stated.explorations.size() * stated.repetitions;
  std::map<std::string, std::size_t> objects;
  for (const std::string& name : stated.class_of) ++objects[name];
  for (const auto& [name, count] : objects)
    if ((count - 1) * of_an_object < 2)
      problems.add({"/classes/" + name, "too few imprints when one object is left out",
                    "2 imprints of other objects of the class",
                    std::to_string((count - 1) * of_an_object),
                    "Use more objects, or more repetitions of two objects"});
}

/// Imprints need presses, and objects in classes.
void check_imprints(const StatedRecipe& stated, const RigLimits& limits, Problems& problems) {
  if (limits.imprint_array && stated.repeat_bad)
    problems.add({"/repeat_bad",
                  "repeat_bad not allowed with an imprint array: its taxels keep their values",
                  "no repeat_bad on this rig", "", "Remove repeat_bad and check the imprints"});
  if (!stated.handover || stated.handover->from != HandoverSource::imprints) return;
  const std::string place = "/hand_over/from";
  for (const StatedExploration& e : stated.explorations)
    if (e.exploration.slides())
      problems.add({place, "exploration with a stroke gives no imprint", "presses only",
                    e.exploration.name, "Set \"kind\" to \"press\" and remove phase M"});
  if (stated.class_of.empty())
    problems.add({place, "classes missing", "\"classes\" of the fabrics", "", ""});
  if (!limits.imprint_array)
    problems.add({place, "rig without an imprint array", "taxels with rows and columns", "",
                  "Use a rig with an imprint array, such as sim/rigs/imprint12.json"});
  for (const StatedExploration& e : stated.explorations)
    if (!e.exploration.slides() &&
        e.exploration.step(Phase::press).duration_s * limits.taxel_rate_hz < 1)
      problems.add({place, "phase P shorter than a scan of the array",
                    "at least " + std::to_string(1 / limits.taxel_rate_hz) + " s",
                    e.exploration.name, ""});
  check_left_to_learn(stated, problems);
}

/// A handover from taxels needs a rig with taxels.
void check_roles(const StatedRecipe& stated, const RigLimits& limits, Problems& problems) {
  if (limits.taxels > 0) return;
  const auto refuse = [&](const std::string& place) {
    problems.add({place, "rig without taxels", "a device with role taxels", "",
                  "Use a rig with taxels, or record the wrench only"});
  };
  if (stated.handover) refuse("/hand_over");
  for (const StatedExploration& e : stated.explorations)
    if (e.exploration.live_vote) refuse("/explorations/" + e.exploration.name + "/live_vote");
}

bool can_end_early(const StatedExploration& stated) {
  const auto& vote = stated.exploration.live_vote;
  return vote && vote->stop_early;
}

/// Handover of a recipe that states none: from taxels, or from imprints on an imprint array.
/// Nullopt if the same handover would be refused when stated. Nullopt also if strokes can end
/// early: only the strokes with an unsure vote would then be complete.
std::optional<Handover> default_handover(const StatedRecipe& stated, const RigLimits& limits) {
  if (stated.sweep || stated.fabrics.size() < 2 || stated.repetitions == 0 ||
      std::ranges::any_of(stated.explorations, can_end_early))
    return std::nullopt;
  StatedRecipe evaluated = stated;
  Handover& handover = evaluated.handover.emplace();
  handover.by_default = true;
  Problems refused;
  if (limits.imprint_array) {
    handover.from = HandoverSource::imprints;
    handover.learner = handover_learners(handover.from).front();
    check_imprints(evaluated, limits, refused);
  } else {
    check_left_to_train(handover, "/hand_over", stated.fabrics.size(), stated.repetitions, refused);
  }
  check_roles(evaluated, limits, refused);
  return refused.empty() ? evaluated.handover : std::nullopt;
}

/// Called before the order is read: an order without a seed of its own uses this one.
void read_seed(std::optional<std::uint64_t> seed, StatedRecipe& stated, Problems& problems) {
  if (!seed) return;
  stated.seed = *seed;
  if (*seed > static_cast<std::uint64_t>(largest_seed))
    problems.add({"/seed", "seed out of range", "0 to " + std::to_string(largest_seed),
                  std::to_string(*seed), ""});
}

}  // namespace

StatedRecipe read_recipe(const json& document, const RigLimits& limits,
                         std::optional<std::uint64_t> seed, Problems& problems) {
  StatedRecipe stated;
  ObjectReader recipe(document, "", problems);
  read_scalars(recipe, stated, problems);
  read_seed(seed, stated, problems);
  read_fabrics(recipe, limits, stated, problems);
  stated.class_of = read_classes(recipe, stated.fabrics, problems);
  read_order(recipe, stated);
  read_approach(recipe, limits, stated);
  read_settle(recipe, stated, problems);
  read_repeat_bad(recipe, stated);
  read_operator_steps(recipe, stated, problems);
  stated.finally = read_finally(recipe, limits, problems);
  stated.declines_handover = recipe.is_false("hand_over");
  stated.handover =
      read_handover(recipe, stated.fabrics.size(), stated.repetitions,
                    limits.acceleration_rate_hz > 0 || limits.sound_rate_hz > 0, problems);
  read_explorations(recipe, limits, stated, problems);
  read_repetition(document, recipe, stated);
  read_sweep(recipe, limits, stated, problems);
  check_imprints(stated, limits, problems);
  check_roles(stated, limits, problems);
  if (!stated.handover && !stated.declines_handover)
    stated.handover = default_handover(stated, limits);
  recipe.finish();
  return stated;
}

}  // namespace weft::recipes
