#include "daemon/service/lab_agent/lab_agent.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/campaign.hpp"

namespace weft::daemon::lab {
namespace {

using nlohmann::json;
using runs::RunState;
using runs::RunView;

constexpr std::size_t sent_at_once = 20;
constexpr std::chrono::seconds rig_period{1}, pause_after_refusal{5};
constexpr const char* by_lab = "auto:lab";
/// A part is settled this long after its run, even if the store has refused to list the run.
constexpr std::chrono::seconds longest_publication{120};

/// As names of recipes are: they become files.
bool is_file_name(std::string_view text) {
  constexpr std::size_t longest = 64;
  const auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !text.empty() && text.size() <= longest && is_letter(text.front()) &&
         std::ranges::all_of(text, [&](char c) { return is_letter(c) || c == '-' || c == '.'; });
}

std::vector<std::string> words_in(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> out;
  for (std::string word; in >> word;) out.push_back(word);
  return out;
}

/// State of a run in the store: the outcome of an ended one.
std::string state_of(const RunView& run) {
  const std::string& outcome = run.stored.outcome;
  return run.state() == RunState::ended && !outcome.empty() ? outcome
                                                            : std::string(to_string(run.state()));
}

/// True if the person at the rig ended it, so that another rig may take the part.
bool was_ended_by_person(const RunView& run) {
  return run.state() == RunState::interrupted || run.stored.outcome == "stopped" ||
         run.stored.outcome == "aborted";
}

}  // namespace

Result<std::unique_ptr<LabAgent>> LabAgent::open(LabAgentContext context) {
  auto outbox = LabOutbox::open(context.store->database());
  if (!outbox) return pass(outbox.error());
  auto part = outbox->part();
  if (!part) return pass(part.error());
  std::unique_ptr<LabAgent> agent(new LabAgent(std::move(context), std::move(*outbox)));
  agent->part_ = std::move(*part);
  if (agent->part_ && agent->part_->run == 0) {  // the daemon ended before it started the run
    agent->is_settling_ = true;
    agent->worker_->settle(agent->part_->lease, std::nullopt);
  } else if (agent->part_) {
    agent->worker_->set_held(agent->part_->lease);
  }
  return agent;
}

LabAgent::LabAgent(LabAgentContext context, LabOutbox outbox)
    : context_(std::move(context)), outbox_(std::move(outbox)) {
  if (const auto text = read_text_file(context_.rig)) rig_sha256_ = sha256_hex(*text);
  if (auto instance = outbox_.instance()) instance_ = std::move(*instance);
  LabReports reports;
  reports.on_published = [this](const UnpublishedRun& run, const Status& done) {
    static_cast<void>(outbox_.on_published(run));
    if (!done) {
      ++publications_refused_;
      newest_refusal_ = to_string(done.error());
      journal(runs::run_id(run.run), "lab.publish_refused", by_lab, {{"error", newest_refusal_}});
    }
    if (const auto sent_run = sent_.find(run.run);
        sent_run != sent_.end() && sent_run->second == run.revision_us)
      sent_.erase(sent_run);
  };
  reports.on_connected = [this](const std::string& store) {
    if (const auto is_other = outbox_.use_store(store); is_other && *is_other) {
      sent_.clear();
      journal("", "lab.store_changed", by_lab, {{"store", store}});
    }
  };
  reports.on_claimed = [this](const ClaimedPart& part) { on_claimed(part); };
  reports.on_renewed = [this](const PartLease& part, bool is_cancelled) {
    if (is_held(part) && is_cancelled) withdraw(by_lab);
  };
  reports.on_lost = [this](const PartLease& part, const Error& why) {
    if (!is_held(part) || is_lost_) return;
    is_lost_ = true;
    journal(part_->run == 0 ? "" : runs::run_id(part_->run), "lab.part_lost", by_lab,
            {{"campaign", campaign_text(part.campaign)}, {"error", to_string(why)}});
  };
  reports.on_settled = [this](const PartLease& part, const Status& done) {
    on_settled(part, done);
  };
  // Reports may arrive after the agent is gone.
  worker_ = std::make_unique<LabWorker>(
      LabWorkerContext{context_.address, "weftd " + context_.rig_name,
                       [post = context_.post, alive = alive_](std::function<void()> report) {
                         post([alive, report = std::move(report)] {
                           if (*alive) report();
                         });
                       },
                       context_.utc_us, context_.lease},
      std::move(reports));
}

LabAgent::~LabAgent() {
  *alive_ = false;
}

bool LabAgent::is_held(const PartLease& lease) const {
  return part_ && part_->lease.token == lease.token;
}

void LabAgent::journal(std::string_view run, std::string_view kind, std::string_view by,
                       const json& payload) {
  context_.store->persist({.journal = {{0, context_.utc_us(), std::string(run), std::string(kind),
                                        std::string(by), payload.dump()}}});
}

void LabAgent::on_run(const RunView& run) {
  const std::int64_t number = run.stored.number;
  std::string state = state_of(run) + "/" + run.stored.dataset_sha256;
  if (std::string& known = run_states_[number]; known != state) {
    if (outbox_.mark(number, state, run.is_over(), context_.utc_us())) known = std::move(state);
  }
  if (part_ && part_->run == number) settle_ended();
}

RunPublication LabAgent::publication_of(const RunView& run, const UnpublishedRun& change) const {
  const runs::StoredRun& stored = run.stored;
  RunEntry entry;
  entry.rig = context_.rig_name;
  entry.run = stored.id();
  entry.recipe = stored.recipe.stem().string();
  entry.recipe_sha256 = stored.recipe_sha256;
  entry.seed = stored.seed;
  entry.fabrics = words_in(stored.fabrics);
  entry.bench = bench_kind_from(stored.bench).value_or(BenchKind::unknown);
  entry.state = state_of(run);
  entry.trials_planned = static_cast<std::int64_t>(run.trials_planned);
  entry.trials_complete = static_cast<std::int64_t>(run.trials_done);
  entry.started_us = stored.created_us;
  if (run.is_over()) entry.ended_us = change.changed_us;
  entry.place = stored.folder.string();
  entry.revision_us = change.revision_us;
  return {change, std::move(entry), stored.folder, run.is_over() ? stored.dataset_sha256 : ""};
}

void LabAgent::send_changed_runs() {
  if (sent_.size() >= sent_at_once) return;
  const auto pending = outbox_.pending(sent_at_once);
  if (!pending) return;
  for (const UnpublishedRun& change : *pending) {
    if (const auto sent_run = sent_.find(change.run);
        sent_run != sent_.end() && sent_run->second == change.revision_us)
      continue;
    const auto run = context_.manager->get(runs::run_id(change.run));
    if (!run) {  // removed from the catalogue
      static_cast<void>(outbox_.on_published(change));
      continue;
    }
    sent_[change.run] = change.revision_us;
    worker_->publish(publication_of(*run, change));
  }
}

void LabAgent::publish_rig() {
  const auto now = context_.now();
  if (rig_published_ && now - *rig_published_ < rig_period) return;
  rig_published_ = now;
  json status{{"run", nullptr},          {"trial", nullptr},          {"trials", nullptr},
              {"eta_s", nullptr},        {"next_action", nullptr},    {"next_action_us", nullptr},
              {"alarms", json::array()}, {"accepts", accepted_.user}, {"part", nullptr}};
  const runs::RigState& rig = context_.manager->rig_state();
  const std::string state = context_.rig_text();
  if (rig.is_latched())
    status["alarms"].push_back(rig.is_emergency() ? "emergency stop" : "halted, needs a reset");
  else if (!rig.can_move())
    status["alarms"].push_back(rig.facts().lock_out ? "locked out" : "needs a reset");
  if (context_.manager->queue().is_paused() && !context_.manager->queue().runs().empty())
    status["alarms"].push_back("queue paused by " + context_.manager->queue().paused_by());
  if (const auto id = context_.manager->active())
    if (const auto run = context_.manager->get(*id)) {
      status["run"] = *id;
      status["recipe"] = run->stored.recipe.stem().string();
      status["run_state"] = to_string(run->state());
      status["trial"] = run->trials_done;
      status["trials"] = run->trials_planned;
      if (run->wall_left_s) status["eta_s"] = std::llround(*run->wall_left_s);
      if (run->operator_prompt) {
        status["next_action"] = run->operator_prompt->prompt.text;
        if (run->operator_prompt->at_us) status["next_action_us"] = *run->operator_prompt->at_us;
      }
    }
  if (!context_.http_url.empty()) status["http"] = context_.http_url;
  if (part_)
    status["part"] = {{"campaign", campaign_text(part_->lease.campaign)},
                      {"fabric", part_->fabric}};
  worker_->set_rig({.name = context_.rig_name,
                    .address = context_.api_address,
                    .bench = load_bench_kind(context_.rig),
                    .state = state,
                    .rig_sha256 = rig_sha256_,
                    .status_json = status.dump(),
                    .instance = instance_});
}

bool LabAgent::is_accepted() const {
  return !accepted_.lease.empty() && context_.lease_holder().lease == accepted_.lease;
}

bool LabAgent::is_free() const {
  const runs::RunManager& manager = *context_.manager;
  const runs::ManagerStatus status = manager.status();
  return !closing_ && !manager.active() && manager.queue().runs().empty() &&
         !manager.queue().is_paused() && status.is_at_rest && !status.is_closing &&
         manager.rig_state().can_move();
}

void LabAgent::tick() {
  if (!is_accepted()) withdraw(by_lab);  // a running part goes on
  publish_rig();
  send_changed_runs();
  if (part_ && part_->run == 0 && is_lost_) forget_part();
  if (part_) settle_ended();
  if (is_accepted() && is_free() && !part_ && context_.now() >= claims_after_)
    worker_->set_claim(RigCapabilities{{}, {refused_campaigns_.begin(), refused_campaigns_.end()}});
  else
    worker_->set_claim(std::nullopt);
}

void LabAgent::on_claimed(const ClaimedPart& part) {
  part_ = HeldPart{part.lease, part.campaign_name, part.fabric, part.attempt, 0};
  is_lost_ = is_settling_ = false;
  if (Status kept = outbox_.set_part(part_); !kept) return refuse(part, kept.error());
  if (closing_ || !is_accepted())
    return refuse(part, {.code = Errc::wrong_state, .what = "operator accepts no parts"});
  const std::string campaign = campaign_text(part.lease.campaign);
  // The store's functions accept any name.
  if (!is_file_name(part.campaign_name)) {
    refused_campaigns_.insert(part.lease.campaign);
    return refuse(part, {.code = Errc::invalid_argument,
                         .where = campaign,
                         .what = "name of the campaign is not a recipe's",
                         .got = shortened(part.campaign_name)});
  }
  const std::filesystem::path folder = context_.data / "lab" / campaign;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  runs::RunRequest request;
  request.recipe = folder / (part.campaign_name + ".json");
  request.seed = part.seed;
  request.name = campaign;
  request.by = "lab:" + campaign;
  request.user = accepted_.user;
  request.keep_going = true;
  request.only_fabric = part.fabric;
  if (part.parameters_json != "{}") request.parameters_json = part.parameters_json;
  if (Status written = write_text_file(request.recipe, part.recipe_text); !written)
    return refuse(part, written.error());
  CampaignRequest check = runs::request_for(request, context_.rig);
  check.recipe_text = part.recipe_text;
  const bool is_sent = context_.background(
      [this, alive = alive_, part, request, check]() -> std::function<void()> {
        auto checked = std::make_shared<runs::Checked>(check_quickly(check));
        return [this, alive, part, request, checked] {
          if (*alive) start(part, request, *checked);
        };
      },
      [this, alive = alive_, part](const Error& why) {
        if (*alive) refuse(part, why);
      });
  if (!is_sent) refuse(part, {.code = Errc::busy, .what = "too much work is waiting"});
}

void LabAgent::start(const ClaimedPart& part, const runs::RunRequest& request,
                     const runs::Checked& checked) {
  if (!is_held(part.lease) || is_settling_) return;
  if (is_lost_) return forget_part();
  if (!checked) {
    refused_campaigns_.insert(part.lease.campaign);
    return refuse(part, checked.error());
  }
  // The check took a while: nothing moves without the lease that accepted it.
  if (!is_accepted())
    return refuse(part, {.code = Errc::wrong_state, .what = "operator accepts no parts"});
  if (!is_free()) return refuse(part, {.code = Errc::wrong_state, .what = "rig is no longer free"});
  const auto run = context_.manager->submit(request, checked);
  if (!run) return refuse(part, run.error());
  part_->run = run->stored.number;
  static_cast<void>(outbox_.set_part(part_));
  journal(run->stored.id(), "lab.part_begun", by_lab,
          {{"campaign", campaign_text(part.lease.campaign)},
           {"fabric", part.fabric},
           {"attempt", part.attempt},
           {"accepted_by", accepted_.user}});
}

void LabAgent::refuse(const ClaimedPart& part, const Error& why) {
  journal("", "lab.part_refused", by_lab,
          {{"campaign", campaign_text(part.lease.campaign)},
           {"fabric", part.fabric},
           {"error", to_string(why)}});
  // A part that it gives back is offered to it again at once.
  claims_after_ = context_.now() + pause_after_refusal;
  is_settling_ = true;
  worker_->settle(part.lease, std::nullopt);
}

void LabAgent::settle_ended() {
  if (is_settling_ || part_->run == 0) return;
  const auto run = context_.manager->get(runs::run_id(part_->run));
  if (run && !run->is_over()) return;
  if (is_lost_) return forget_part();
  if (!run || was_ended_by_person(*run)) {
    is_settling_ = true;
    withdraw(by_lab);
    return worker_->settle(part_->lease, std::nullopt);
  }
  // The data set of a part that is done can be fetched, unless its publication does not succeed.
  if (!ended_at_) ended_at_ = context_.now();
  const auto waits = outbox_.has(part_->run);
  if ((!waits || *waits) && context_.now() - *ended_at_ < longest_publication) return;
  is_settling_ = true;
  PartResult result;
  result.run = runs::run_id(part_->run);
  result.dataset_sha256 = run->stored.dataset_sha256;
  result.is_done = run->stored.has_all() && !result.dataset_sha256.empty();
  if (!result.is_done) {
    result.error = run->stored.error.empty() ? "not every trial is complete" : run->stored.error;
    withdraw(by_lab);  // a defective rig must not fail all parts
  }
  worker_->settle(part_->lease, result);
}

void LabAgent::forget_part() {
  part_.reset();
  ended_at_.reset();
  is_lost_ = is_settling_ = false;
  static_cast<void>(outbox_.set_part(std::nullopt));
}

void LabAgent::on_settled(const PartLease& part, const Status& done) {
  if (!is_held(part)) return;
  journal(
      part_->run == 0 ? "" : runs::run_id(part_->run), done ? "lab.part_settled" : "lab.part_lost",
      by_lab,
      done ? json{{"campaign", campaign_text(part.campaign)}}
           : json{{"campaign", campaign_text(part.campaign)}, {"error", to_string(done.error())}});
  forget_part();
}

void LabAgent::close() {
  closing_ = true;
  worker_->set_claim(std::nullopt);
}

Status LabAgent::accept(const std::string& lease) {
  const LabAgentContext::LeaseHolder holder = context_.lease_holder();
  if (holder.lease != lease)
    return fail({.code = Errc::wrong_state,
                 .where = "lease",
                 .what = "parts are accepted under the present lease of the rig only",
                 .expected = lease,
                 .got = holder.lease.empty() ? "no lease" : holder.lease,
                 .hint = "Acquire the lease first and keep it"});
  if (accepted_.lease == lease) return {};
  accepted_ = holder;
  rig_published_.reset();
  journal("", "lab.accepted", holder.user,
          {{"store", context_.address.text()}, {"lease", holder.lease}});
  return {};
}

void LabAgent::withdraw(std::string_view by) {
  if (accepted_.lease.empty()) return;
  accepted_ = {};
  rig_published_.reset();
  journal("", "lab.withdrawn", by, json::object());
}

json LabAgent::status_json() {
  const LabConnection connection = worker_->connection();
  const auto unpublished = outbox_.count();
  json out{{"rig", context_.rig_name},
           {"store", context_.address.text()},
           {"is_connected", connection.is_connected},
           {"error", connection.error.empty() ? json() : json(connection.error)},
           {"reached_us", connection.since_us == 0 ? json() : json(connection.since_us)},
           {"unpublished", unpublished ? json(*unpublished) : json()},
           {"refused", publications_refused_},
           {"newest_refusal", newest_refusal_.empty() ? json() : json(newest_refusal_)},
           {"accepted_by", accepted_.user.empty() ? json() : json(accepted_.user)},
           {"part", nullptr}};
  if (part_)
    out["part"] = {{"campaign", campaign_text(part_->lease.campaign)},
                   {"number", part_->lease.number},
                   {"fabric", part_->fabric},
                   {"attempt", part_->attempt},
                   {"run", part_->run == 0 ? json() : json(runs::run_id(part_->run))},
                   {"is_lost", is_lost_}};
  return out;
}

json LabAgent::rigs_json() {
  const LabWorker::Rigs known = worker_->rigs();
  const LabConnection connection = worker_->connection();
  json rigs = json::array();
  for (const RigEntry& rig : known.rigs)
    rigs.push_back({{"rig", rig.name},
                    {"address", rig.address},
                    {"bench", to_string(rig.bench)},
                    {"state", rig.state},
                    {"seen_us", rig.seen_us},
                    {"status", json::parse(rig.status_json)}});  // as bounded_status() wrote it
  return {{"rigs", std::move(rigs)},
          {"read_us", known.at_us == 0 ? json() : json(known.at_us)},
          {"now_us", context_.utc_us()},
          {"is_connected", connection.is_connected},
          {"error", connection.error.empty() ? json() : json(connection.error)}};
}

}  // namespace weft::daemon::lab
