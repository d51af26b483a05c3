#include "recipes/engine/canonical.hpp"

#include <nlohmann/json.hpp>

#include "recipes/engine/last_steps.hpp"
#include "recipes/engine/sweep_cells.hpp"

namespace weft::recipes {
namespace {

using nlohmann::json;

json normal(const Vec2& point) {
  return {{"x_m", point.x_m}, {"y_m", point.y_m}};
}

json normal(const PhaseStep& step) {
  json out{{"phase", std::string(1, to_char(step.phase))}};
  if (step.phase != Phase::motion) out["duration_s"] = step.duration_s;
  if (step.phase == Phase::press || step.phase == Phase::motion) {
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

json normal(const Handover& handover) {
  json out{{"learner", handover.learner},
           {"groups", handover.groups},
           {"at_most_s", handover.at_most_s}};
  if (handover.from != HandoverSource::taxels) out["from"] = to_string(handover.from);
  return out;
}

/// The cells follow from it.
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

/// Swept or not. Where a stroke is swept the start is centred for each, unless it is stated.
json normal(const StatedExploration& stated, const std::optional<Sweep>& sweep) {
  if (!sweep) return normal(stated.exploration);
  json out = normal(at_first_values(stated.exploration, *sweep));
  if (varies(*sweep, FactorKind::stroke) && !stated.start_m) out.erase("start");
  return out;
}

json normal_order(const StatedRecipe& stated) {
  if (stated.order == Order::blocked) return {{"kind", "blocked"}};
  return {{"kind", "randomised"}, {"seed", stated.order_seed}};
}

}  // namespace

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
  if (stated.repeat_bad) document["repeat_bad"] = normal(*stated.repeat_bad);
  for (const OperatorStep& step : stated.operator_steps)
    document["operator_steps"].push_back(normal(step, stated.fabrics));
  if (!is_empty(stated.finally)) document["finally"] = normal(stated.finally);
  if (stated.handover) document["hand_over"] = normal(*stated.handover);
  if (stated.sweep) {
    document["sweep"] = normal(*stated.sweep);
    document.erase("repetitions");
    document.erase("order");
  }
  return document.dump();
}

}  // namespace weft::recipes
