#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "recipes/control/servo.hpp"
#include "recipes/engine/draws.hpp"
#include "recipes/engine/motion.hpp"
#include "recipes/engine/operator_steps.hpp"
#include "recipes/engine/plan.hpp"
#include "recipes/engine/recipe_reader.hpp"
#include "recipes/schema/object_reader.hpp"
#include "recipes/schema/parameters.hpp"
#include "recipes/schema/quantities.hpp"

namespace weft::recipes {
namespace {

using nlohmann::json;

/// Uniform in [0, bound) without bias: draws in the incomplete last interval are discarded.
std::uint64_t below(std::uint64_t bound, std::uint64_t& state) {
  const std::uint64_t remainder = (UINT64_MAX % bound + 1) % bound;
  std::uint64_t draw = next_splitmix64(state);
  while (draw > UINT64_MAX - remainder) draw = next_splitmix64(state);
  return draw % bound;
}

TrialSpec trial_of(std::size_t fabric, std::size_t exploration, std::uint32_t repetition) {
  TrialSpec trial;
  trial.fabric = fabric;
  trial.exploration = exploration;
  trial.repetition = repetition;
  return trial;
}

template <class Item>
void shuffle(std::vector<Item>& list, std::uint64_t& state) {
  for (std::size_t i = list.size(); i > 1; --i) std::swap(list[i - 1], list[below(i, state)]);
}

/// The trials of a sweep. Each replicate of a fabric is a complete block with its own random order.
class SweptTrials {
 public:
  SweptTrials(const StatedRecipe& stated, const Sweep& sweep)
      : stated_(stated), sweep_(sweep), state_(sweep.seed) {}

  std::vector<TrialSpec> all() {
    const bool by_replicate = sweep_.block_by == BlockBy::replicate;
    if (by_replicate)
      for (std::uint32_t r = 1; r <= sweep_.replicates; ++r)
        for (const std::size_t f : make_order(stated_.fabrics.size())) add_block(f, r);
    else
      for (std::size_t f = 0; f < stated_.fabrics.size(); ++f)
        for (std::uint32_t r = 1; r <= sweep_.replicates; ++r) add_block(f, r);
    if (sweep_.block_by == BlockBy::none && sweep_.randomised) shuffle(trials_, state_);
    return std::move(trials_);
  }

 private:
  std::vector<std::size_t> make_order(std::size_t count) {
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (sweep_.randomised) shuffle(order, state_);
    return order;
  }

  void add_block(std::size_t fabric, std::uint32_t replicate) {
    for (const std::size_t e : make_order(stated_.explorations.size()))
      trials_.push_back(trial_of(fabric, e, replicate));
  }

  const StatedRecipe& stated_;
  const Sweep& sweep_;
  std::uint64_t state_;
  std::vector<TrialSpec> trials_;
};

std::vector<TrialSpec> blocked(const StatedRecipe& stated) {
  std::vector<TrialSpec> trials;
  const std::uint32_t pieces = stated.repetition.pieces;
  for (std::size_t f = 0; f < stated.fabrics.size(); ++f)
    for (std::uint32_t piece = 1; piece <= pieces; ++piece)
      for (std::size_t e = 0; e < stated.explorations.size(); ++e)
        for (std::uint32_t r = 1; r <= stated.repetitions; ++r)
          if (piece_of(r, stated.repetitions, pieces) == piece) trials.push_back(trial_of(f, e, r));
  return trials;
}

std::vector<TrialSpec> shuffled(const StatedRecipe& stated) {
  std::vector<TrialSpec> trials = blocked(stated);
  std::uint64_t state = stated.order_seed;
  shuffle(trials, state);
  return trials;
}

/// Blocked: sorted by fabric, then piece, then exploration, then repetition. Randomised: the
/// blocked list shuffled (Fisher and Yates) by splitmix64 with the seed of the order.
std::vector<TrialSpec> ordered_trials(const StatedRecipe& stated) {
  std::vector<TrialSpec> trials = stated.sweep ? SweptTrials(stated, *stated.sweep).all()
                                  : stated.order == Order::randomised ? shuffled(stated)
                                                                      : blocked(stated);
  for (std::size_t i = 0; i < trials.size(); ++i) trials[i].index = i;
  return trials;
}

json normal(const Vec2& point) {
  return {{"x_m", point.x_m}, {"y_m", point.y_m}};
}

json normal(const PhaseStep& step) {
  json out{{"phase", std::string(1, to_char(step.phase))}};
  if (step.phase != Phase::motion) out["duration_s"] = step.duration_s;
  if (step.depth_m > 0) out["press_depth_m"] = step.depth_m;
  if (step.force_band_n > 0) {
    out["force_n"] = step.force_n;
    out["force_band_n"] = step.force_band_n;
  }
  if (step.phase == Phase::motion) {
    out["speed_mps"] = step.speed_mps;
    for (const Vec2& corner : step.path_m) out["corners"].push_back(normal(corner));
  }
  return out;
}

json normal(const LiveVote& vote) {
  json out{{"model", vote.model}};
  if (vote.stop_early)
    out["stop_early"] = {{"sure_probability", vote.stop_early->sure_probability},
                         {"least_slide_s", vote.stop_early->least_slide_s}};
  return out;
}

json normal(const Exploration& exploration) {
  json phases = json::array();
  for (const PhaseStep& step : exploration.phases) phases.push_back(normal(step));
  json out{{"phases", std::move(phases)}, {"start", normal(exploration.start_m)}};
  if (exploration.live_vote) out["live_vote"] = normal(*exploration.live_vote);
  return out;
}

json normal(const RepeatBad& bad) {
  return {{"at_most", bad.at_most},
          {"lost_fraction", bad.lost_fraction},
          {"saturated_fraction", bad.saturated_fraction},
          {"still_taxel_s", bad.still_taxel_s},
          {"force_in_band_fraction", bad.force_in_band_fraction}};
}

json normal(const OperatorStep& step, const std::vector<std::string>& names) {
  const bool once = step.before == OperatorStep::Before::campaign;
  json out{
      {"before", once ? "campaign" : "fabric"}, {"text", step.text}, {"people_s", step.people_s}};
  for (const std::size_t fabric : step.fabrics) out["fabrics"].push_back(names[fabric]);
  return out;
}

json normal(const std::vector<LastStep>& steps) {
  json out = json::array();
  for (const LastStep& step : steps)
    if (const auto* const park = std::get_if<ParkStep>(&step))
      out.push_back({{"do", "park"}, {"x_m", park->x_m}, {"y_m", park->y_m}});
    else
      out.push_back({{"do", "wait"}, {"duration_s", std::get<WaitStep>(step).duration_s}});
  return out;
}

json normal(const Finally& finally) {
  return {{"on_success", normal(finally.on_success)},
          {"on_stop", normal(finally.on_stop)},
          {"on_fault", normal(finally.on_fault)},
          {"budget_s", finally.budget_s}};
}

json normal(const Repetition& repetition) {
  json out{{"path", repetition.path == Repetition::Path::same ? "same" : "new_patch"},
           {"piece", repetition.pieces == 1 ? "one" : "each_label_split"}};
  out["remount_every"] =
      repetition.remount_every == 0 ? json("never") : json(repetition.remount_every);
  if (repetition.pieces > 1) out["pieces"] = repetition.pieces;
  return out;
}

json normal(const Handover& handover) {
  json out{{"learner", handover.learner},
           {"groups", handover.groups},
           {"at_most_s", handover.at_most_s}};
  if (handover.from != HandoverSource::taxels) out["from"] = to_string(handover.from);
  return out;
}

/// The cells are left out because they follow from the rest.
json normal(const Sweep& sweep) {
  json out{{"replicates", sweep.replicates},
           {"order", sweep.randomised ? "randomised" : "as_listed"},
           {"block_by", to_string(sweep.block_by)},
           {"design", "full"}};
  if (sweep.randomised) out["seed"] = sweep.seed;
  for (const Factor& factor : sweep.factors)
    out["factors"].push_back({{"name", factor_name(factor.kind)}, {"values", factor.values}});
  if (sweep.fraction)
    out["design"] = {{"cell_fraction", sweep.fraction->share},
                     {"model", to_string(sweep.fraction->model)}};
  return out;
}

/// Normal form with or without a sweep. A swept stroke or direction has a centred start in each
/// cell, unless the recipe states one.
json normal(const StatedExploration& stated, const std::optional<Sweep>& sweep) {
  if (!sweep) return normal(stated.exploration);
  json out = normal(at_first_values(stated.exploration, *sweep));
  const bool moves = varies(*sweep, FactorKind::stroke) || varies(*sweep, FactorKind::direction);
  if (moves && !stated.start_m) out.erase("start");
  return out;
}

json normal_order(const StatedRecipe& stated) {
  if (stated.order == Order::blocked) return {{"kind", "blocked"}};
  return {{"kind", "randomised"}, {"seed", stated.order_seed}};
}

/// Sorted keys, SI units, defaults and chosen starts included; description and source left out.
/// Each number is the shortest text that reads back as the same double.
std::string canonical_json(const StatedRecipe& stated) {
  json explorations = json::object();
  for (const StatedExploration& e : stated.explorations)
    explorations[e.exploration.name] = normal(e, stated.sweep);
  const bool stops = stated.on_trial_failure == OnTrialFailure::stop;
  json document{
      {"schema_version", 1},
      {"name", stated.name},
      {"seed", stated.seed},
      {"fabrics", stated.fabrics},
      {"repetitions", stated.repetitions},
      {"order", normal_order(stated)},
      {"explorations", std::move(explorations)},
      {"approach",
       {{"speed_mps", stated.approach.speed_mps},
        {"seat_speed_mps", stated.approach.seat_speed_mps},
        {"transfer_speed_mps", stated.approach.transfer_speed_mps},
        {"contact_force_n", stated.approach.contact_force_n}}},
      {"settle", {{"dwell_s", stated.settle.dwell_s}, {"timeout_s", stated.settle.timeout_s}}},
      {"on_trial_failure", stops ? "stop" : "continue"},
      {"mount_timeout_s", stated.mount_timeout_s}};
  for (std::size_t i = 0; i < stated.class_of.size(); ++i)
    document["classes"][stated.class_of[i]].push_back(stated.fabrics[i]);
  if (stated.repetition != Repetition{}) document["repetition"] = normal(stated.repetition);
  if (stated.repeat_bad) document["repeat_bad"] = normal(*stated.repeat_bad);
  for (const OperatorStep& step : stated.operator_steps)
    document["operator_steps"].push_back(normal(step, stated.fabrics));
  if (!is_empty(stated.finally)) document["finally"] = normal(stated.finally);
  // The default is not written, so that a recipe without the key keeps its digest.
  if (stated.declines_handover) document["hand_over"] = false;
  if (stated.handover && !stated.handover->by_default)
    document["hand_over"] = normal(*stated.handover);
  if (stated.sweep) {
    document["sweep"] = normal(*stated.sweep);
    document.erase("repetitions");
    document.erase("order");
  }
  return document.dump();
}

void check_trial_count(const StatedRecipe& stated, Problems& problems) {
  const std::uint64_t trials =
      std::uint64_t{stated.fabrics.size()} * stated.explorations.size() * stated.repetitions;
  if (trials > max_trials)
    problems.add({"", "too many trials", "at most " + std::to_string(max_trials),
                  std::to_string(trials), "Lower \"repetitions\""});
}

/// On a real bench a person mounts the fabric. Adds a step for each fabric that no step of the
/// recipe mentions. Returns whether any was added.
bool add_mount_steps(Plan& plan) {
  using Before = OperatorStep::Before;
  const bool again = plan.repetition.remount_every > 0 || plan.repetition.pieces > 1;
  const Before before = again ? Before::mounting : Before::fabric;
  OperatorStep mount{before, {}, "Mount {fabric}, then confirm.", 60};
  if (again) mount.text = "Mount {fabric}, piece {piece} (mounting {mounting}), then confirm.";
  for (std::size_t fabric = 0; fabric < plan.fabrics.size(); ++fabric)
    if (!has_prompt_before(plan, fabric, before)) mount.fabrics.push_back(fabric);
  if (mount.fabrics.empty()) return false;
  plan.operator_steps.push_back(std::move(mount));
  return true;
}

/// The recipe has no problems here, so everything is present.
Plan make_plan(StatedRecipe stated, const RigLimits& limits, std::string canonical) {
  Plan plan;
  plan.canonical_json = std::move(canonical);
  plan.trials = ordered_trials(stated);
  assign_places(stated, limits, plan.trials);
  for (StatedExploration& exploration : stated.explorations)
    plan.explorations.push_back(std::move(exploration.exploration));
  static_cast<RecipeTerms&>(plan) = std::move(stated);
  plan.limits = limits;
  for (Exploration& exploration : plan.explorations)
    for (PhaseStep& phase : exploration.phases)
      if (phase.phase == Phase::motion)
        phase.duration_s = motion_duration_s(exploration, limits.max_acceleration_mps2);
  return plan;
}

std::vector<Diagnostic> warnings_about(const Plan& plan) {
  std::vector<Diagnostic> warnings;
  const double cycles = plan.limits.cycle_hz * plan.settle.dwell_s;
  if (plan.limits.has_wrench && cycles < 5)
    warnings.push_back({"/settle/dwell_s", "dwell time too short to judge a settled force",
                        "at least 5 cycles", std::to_string(cycles), "Raise dwell_s"});
  if (plan.limits.fabrics.empty())
    warnings.push_back(
        {"/fabrics", "fabric names not checked: the rig file lists no fabrics", "", "", ""});
  if (!plan.limits.slack_m)
    warnings.push_back({"",
                        "slack of the probe mount unknown; the first trial shows whether the probe "
                        "rests by its weight alone",
                        "", "", "Add probe.slack_mm to the rig file"});
  if (!plan.limits.wrench_noise || !plan.limits.taxel_noise)
    warnings.push_back(
        {"",
         std::string("simulated without noise: no check for frozen readings of the ") +
             (plan.limits.taxel_noise    ? "wrench"
              : plan.limits.wrench_noise ? "taxels"
                                         : "wrench and the taxels"),
         "", "", ""});
  const std::size_t once = plan.fabrics.size() * plan.operator_steps.size();
  const bool remounts = plan.repetition.remount_every > 0 || plan.repetition.pieces > 1;
  if (!remounts && plan.forecast.prompts > once)
    warnings.push_back({"/operator_steps", "fabrics mounted more than once",
                        std::to_string(once) + " times",
                        std::to_string(plan.forecast.prompts) + " times",
                        "Use a blocked order to mount each fabric once"});
  for (const auto& more : {warnings_about_budget(plan.finally), warnings_about_sweep(plan),
                           warnings_about_places(plan)})
    warnings.insert(warnings.end(), more.begin(), more.end());
  return warnings;
}

/// Binds the parameters, if there are any. True if there was no problem.
bool resolve(json& document, std::string_view values_json, CheckReport& report,
             Problems& problems) {
  if (document.is_object() && document.contains("parameters"))
    report.parameters_json = document["parameters"].dump();
  if (!bind_parameters(document, values_json, problems) || !problems.empty())
    return problems.empty();
  std::string text = document.dump(2) + "\n";
  if (text.size() > max_recipe_bytes)
    problems.add({"", "resolved recipe too large",
                  "at most " + std::to_string(max_recipe_bytes) + " bytes",
                  std::to_string(text.size()) + " bytes", ""});
  report.recipe_json = std::move(text);
  return problems.empty();
}

/// The rest height must be within the slack of the mount at the latest possible stop of the stage.
void check_rest(const StatedRecipe& stated, const RigLimits& limits, Problems& problems) {
  constexpr double margin_m = 10e-6;
  const double needed_m =
      limits.rest_travel_m + run_on_m(stated.approach.seat_speed_mps) + margin_m;
  if (!limits.has_wrench || !limits.slack_m || *limits.slack_m > needed_m) return;
  problems.add(
      {"/approach/seat_speed_mm_s",
       "seat speed too high: the stage may leave the slack of the probe mount",
       "a slack above " + json(needed_m * quantities::mm_per_m).dump() + " mm",
       json(*limits.slack_m * quantities::mm_per_m).dump() + " mm (the rig's probe.slack_mm)",
       "Lower seat_speed_mm_s, or probe.rest_travel_mm of the rig"});
}

/// With the rotary stages at the level angles, z follows the plate to every patch.
void check_patches(const Plan& plan, Problems& problems) {
  if (!plan.limits.levelled() || plan.repetition.path == Repetition::Path::same) return;
  for (const TrialSpec& trial : plan.trials) {
    const Exploration& exploration = plan.explorations[trial.exploration];
    Result<Joints> there = above_start(plan, trial);
    for (std::size_t leg = 0; there && leg < exploration.path_m().size(); ++leg)
      there = over(plan.limits, path_leg(exploration, leg, trial.place.offset_m).to_m,
                   plan.limits.clearance_m);
    if (there) continue;
    return problems.add(
        {"/repetition/path", "patch outside the travel of the stages: " + there.error().what,
         there.error().expected, there.error().got, "Level the plate by hand first"});
  }
}

/// Adds the plan and the warnings if there is no problem.
void check_resolved(const json& document, const RigLimits& limits,
                    std::optional<std::uint64_t> seed, CheckReport& report, Problems& problems) {
  StatedRecipe stated = read_recipe(document, limits, seed, problems);
  check_trial_count(stated, problems);
  check_rest(stated, limits, problems);
  for (StatedExploration& exploration : stated.explorations)
    place_on_plate(exploration, limits, problems);
  if (!problems.empty()) return;
  std::string canonical = canonical_json(stated);
  spread_sweep(stated, limits, problems);
  check_repetition(stated, limits, problems);
  if (!problems.empty()) return;
  report.plan = make_plan(std::move(stated), limits, std::move(canonical));
  check_patches(*report.plan, problems);
  if (!problems.empty()) return report.plan.reset();
  Plan& plan = *report.plan;
  const bool adds_mounts = limits.bench == "real" && add_mount_steps(plan);
  plan.forecast = forecast(plan);
  report.warnings = warnings_about(plan);
  if (adds_mounts)
    report.warnings.push_back(
        {"/operator_steps",
         "no mounting step for some fabrics; one is added before the first trial of each",
         "a step with \"before\": \"fabric\" for each fabric", "", ""});
}

}  // namespace

std::uint64_t patch_seed(std::uint64_t recipe_seed, std::string_view fabric,
                         std::string_view exploration, std::uint32_t repetition) {
  std::string key = std::to_string(recipe_seed);
  for (const std::string_view part : {fabric, exploration}) (key += '/') += part;
  (key += '/') += std::to_string(repetition);
  return seed_of(key);
}

CheckReport check_recipe(std::string_view recipe_json, const RigLimits& limits,
                         std::optional<std::uint64_t> seed, std::string_view values_json) {
  Problems problems;
  nlohmann::json document;
  CheckReport report;
  report.recipe_json = recipe_json;
  if (parse_json(recipe_json, {.max_bytes = max_recipe_bytes}, document, problems) &&
      resolve(document, values_json, report, problems))
    check_resolved(document, limits, seed, report, problems);
  report.problems = problems.take();
  return report;
}

}  // namespace weft::recipes
