#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

using access::Role;
using nlohmann::json;
using rpc::Call;
using rpc::Effect;
using rpc::Outcome;
using rpc::ParamType;

constexpr rpc::ParamSpec handover_run{"run", ParamType::text, true, "its name, \"R-000318\""};

Outcome run_after(const Services& services, const Call& call, const Status& done) {
  if (!done) return refused(done.error());
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return refused(run.error());
  return format_text(run_json(*run));
}

json text_or_null(const std::string& text) {
  return text.empty() ? json() : json(text);
}

}  // namespace

// Every key each time, so that a listener who merges changes keeps nothing of the state before.
json handover_json(const HandoverStatus& fact) {
  const bool runs = fact.state == HandoverState::running;
  json out{{"state", to_string(fact.state)},
           {"by", fact.by},
           {"error", text_or_null(fact.error)},
           {"step", nullptr},
           {"steps", nullptr},
           {"what", runs ? text_or_null(fact.what) : json()},
           {"bench", nullptr},
           {"dataset_sha256", nullptr},
           {"models", nullptr},
           {"evaluations", nullptr}};
  if (runs && fact.steps > 0) {
    out["step"] = fact.step + 1;
    out["steps"] = fact.steps;
  }
  if (const json result = json::parse(fact.result_json, nullptr, false); result.is_object())
    out.update(result);
  return out;
}

void add_handover_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add({"handover.start",
               "trains and evaluates once more what a run's recipe hands over, where that failed, "
               "was cancelled or its files were damaged; by itself it is done once a campaign is "
               "complete",
               Role::operator_,
               Effect::change,
               {handover_run},
               "the run"},
              [s](const Call& call) {
                return run_after(*s, call, s->handovers->again(run_of(call), by(call.caller)));
              });
  methods.add({"handover.cancel",
               "ends a hand-over that waits or runs; the run and its data stay as they are",
               Role::operator_,
               Effect::change,
               {handover_run},
               "the run"},
              [s](const Call& call) {
                return run_after(*s, call, s->handovers->cancel(run_of(call), by(call.caller)));
              });
}

}  // namespace weft::daemon::api
