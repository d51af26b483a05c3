#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

using nlohmann::json;
using rpc::Call;
using rpc::Outcome;
using rpc::ParamType;

Outcome live(const Services& services, const Call& call) {
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return refused(run.error());
  json out{{"run", run->stored.id()}, {"vote", nullptr}};
  if (run->vote) out["vote"] = vote_json(*run->vote);
  return format_text(out);
}

}  // namespace

json vote_json(const LiveVoteUpdate& vote) {
  // An array: a merge patch replaces it, so that no label of another model stays.
  json probability = nullptr;  // a model without aids knows none
  for (const auto& [label, share] : vote.probability)
    probability.push_back({{"label", label}, {"probability", share}});
  return {{"trial", vote.trial},
          {"fabric", vote.fabric},
          {"exploration", vote.exploration},
          {"repetition", vote.repetition},
          {"slide_s", vote.slide_s},
          {"winner", vote.winner},
          {"probability", std::move(probability)},
          {"none_of_these", vote.none_of_these},
          {"model_bench", vote.model_bench},
          {"ends_slide", vote.ends_slide},
          {"by", "auto:live_vote"}};
}

void add_classify_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add(
      {"classify.live",
       "the newest vote of a run whose recipe has a live vote; each is an event of the "
       "topic \"vote:R-000318\" too",
       {},
       {},
       {{"run", ParamType::text, true, "its name, \"R-000318\""}},
       "run, vote: trial, fabric, exploration, repetition, slide_s, winner, probability (by "
       "label), none_of_these, model_bench, ends_slide; null before the first"},
      [s](const Call& call) { return live(*s, call); });
}

}  // namespace weft::daemon::api
