#include "daemon/service/lab_agent/lab_worker.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/dataset/dataset_reader.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon::lab {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds heartbeat{10}, claim_period{2}, rigs_period{2}, rigs_wanted_for{10};
constexpr milliseconds pause{200}, first_retry{500};

bool is_due(std::chrono::nanoseconds last, std::chrono::nanoseconds period) {
  return last.count() == 0 || steady_wall_now() - last >= period;
}

/// Whether the store has refused a call for good, whatever changes: the lease is lost (WL001) or
/// the values are wrong. A missing right or a read-only copy can be mended by an administrator.
bool is_refused_for_good(const Error& error, std::string_view sqlstate) {
  if (sqlstate.empty()) return error.code == Errc::invalid_argument;
  return sqlstate.starts_with("WL") || sqlstate.starts_with("22") || sqlstate.starts_with("23");
}

bool is_same(const RigEntry& a, const RigEntry& b) {
  return a.state == b.state && a.status_json == b.status_json && a.rig_sha256 == b.rig_sha256 &&
         a.address == b.address;
}

bool is_same(const PartLease& a, const PartLease& b) {
  return a.campaign == b.campaign && a.number == b.number && a.token == b.token;
}

/// The trials of a data set, without reading a sample.
std::vector<TrialEntry> trials_of(const DatasetReader& dataset) {
  std::vector<TrialEntry> out;
  const Dataset& listed = dataset.listed();
  for (std::size_t i = 0; i < listed.records.size(); ++i) {
    const TrialSpec& spec = listed.records[i].spec;
    out.push_back({spec.index, spec.label, spec.exploration, spec.repetition,
                   std::string(to_string(listed.records[i].outcome)),
                   dataset.digest().trial_sha256[i]});
  }
  return out;
}

}  // namespace

std::string bounded_status(const std::string& status_json) {
  using nlohmann::json;
  constexpr std::size_t most_bytes = 65536, most_depth = 8, longest_text = 500, most_alarms = 20;
  const auto status = parse_json(status_json, {most_bytes, most_depth});
  if (!status || !status->is_object()) return "null";
  json out = json::object();
  const auto text_of = [&](const json& value) {
    return as_utf8(value.get_ref<const std::string&>().substr(0, longest_text));
  };
  for (const char* key : {"run", "recipe", "run_state", "next_action", "accepts", "http"})
    if (const auto found = status->find(key); found != status->end() && found->is_string())
      out[key] = text_of(*found);
  for (const char* key : {"trial", "trials", "eta_s", "next_action_us"})
    if (const auto found = status->find(key); found != status->end() && found->is_number_integer())
      out[key] = *found;
  out["alarms"] = json::array();
  if (const auto found = status->find("alarms"); found != status->end() && found->is_array())
    for (const json& alarm : *found)
      if (alarm.is_string() && out["alarms"].size() < most_alarms)
        out["alarms"].push_back(text_of(alarm));
  if (const auto part = status->find("part"); part != status->end() && part->is_object())
    for (const char* key : {"campaign", "fabric"})
      if (const auto found = part->find(key); found != part->end() && found->is_string())
        out["part"][key] = text_of(*found);
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

LabWorker::LabWorker(LabWorkerContext context, LabReports reports)
    : context_(std::move(context)),
      reports_(std::move(reports)),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

LabWorker::~LabWorker() {
  thread_.request_stop();
  changed_.notify_all();
  thread_.join();
}

void LabWorker::set_rig(RigEntry rig) {
  const std::lock_guard lock(mutex_);
  requests_.rig = std::move(rig);
}

void LabWorker::publish(RunPublication run) {
  const std::lock_guard lock(mutex_);
  const std::int64_t number = run.change.run;
  requests_.runs.insert_or_assign(number, std::move(run));
}

void LabWorker::set_claim(std::optional<RigCapabilities> can) {
  const std::lock_guard lock(mutex_);
  requests_.claim = std::move(can);
}

void LabWorker::set_held(std::optional<PartLease> part) {
  const std::lock_guard lock(mutex_);
  requests_.held = std::move(part);
}

void LabWorker::settle(const PartLease& part, std::optional<PartResult> result) {
  const std::lock_guard lock(mutex_);
  requests_.held.reset();
  requests_.settlement = Settlement{part, std::move(result)};
  changed_.notify_all();
}

LabConnection LabWorker::connection() const {
  const std::lock_guard lock(mutex_);
  return connection_;
}

LabWorker::Rigs LabWorker::rigs() {
  const std::lock_guard lock(mutex_);
  requests_.rigs_wanted_until = steady_wall_now() + rigs_wanted_for;
  return rigs_;
}

void LabWorker::wait(const std::stop_token& stop, milliseconds longest) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, longest, [] { return false; });
}

void LabWorker::note(const Status& done) {
  const std::lock_guard lock(mutex_);
  connection_.is_connected = store_ && store_->is_connected();
  if (done) {
    connection_.error = rig_refusal_;
    connection_.since_us = context_.utc_us();
  } else {
    connection_.error = to_string(done.error());
  }
}

bool LabWorker::connect(const std::stop_token& stop) {
  if (store_ && store_->is_connected()) return true;
  Status done;
  if (store_) {
    // Often while a part is held: its lease must not end in the pause.
    std::chrono::milliseconds pause_now = store_->retry_wait();
    if (renewing_) pause_now = std::min<milliseconds>(pause_now, context_.lease / 6);
    wait(stop, pause_now);
    if (stop.stop_requested()) return false;
    done = store_->reconnect();
  } else {
    auto opened = LabStore::open(context_.address, context_.program);
    if (opened) {
      store_.emplace(std::move(*opened));
      done = store_->listen("weft_parts");
    } else {
      done = pass(opened.error());
    }
  }
  note(done);
  published_rig_.reset();  // it may be another database now
  if (done) {
    context_.post([this, id = store_->id()] { reports_.on_connected(id); });
    return true;
  }
  if (!store_) wait(stop, claim_period);
  return false;
}

void LabWorker::work(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    if (!connect(stop)) continue;
    const Status done = round();
    note(done);
    if (!done) {
      wait(stop, first_retry);
      continue;
    }
    // A notice of a new part ends the wait and makes the next claim due.
    if (const auto notice = store_->wait(pause); notice && *notice) claimed_ = {};
  }
}

Status LabWorker::round() {
  Requests requests;
  {
    const std::lock_guard lock(mutex_);
    requests = requests_;
  }
  Status done = renew(requests);
  if (done) done = settle(requests);
  if (done) done = publish_rig(requests);
  for (const auto& [number, run] : requests.runs) {
    if (done) done = publish_one(run);
    if (done) done = renew(requests);
  }
  if (done) done = claim(requests);
  if (done) done = read_rigs(requests);
  return done;
}

Status LabWorker::publish_rig(const Requests& requests) {
  if (!requests.rig) return {};
  const bool is_new = !published_rig_ || !is_same(*published_rig_, *requests.rig);
  const bool is_refused = !rig_refusal_.empty();
  if ((!is_new || is_refused) && !is_due(rig_published_, heartbeat)) return {};
  const Status done = store_->publish_rig(*requests.rig);
  if (!done && !is_refused_for_good(done.error(), store_->sqlstate())) return done;
  // A refused rig publishes and claims nothing; a part that it holds is still renewed and settled.
  rig_refusal_ = done ? "" : to_string(done.error());
  published_rig_ = done ? requests.rig : std::nullopt;
  rig_published_ = steady_wall_now();
  return {};
}

Status LabWorker::publish_one(const RunPublication& run) {
  if (!published_rig_) return {};  // the store must know the rig first
  Status done = store_->publish_run(run.entry);
  if (done && !run.dataset_sha256.empty()) {
    const std::filesystem::path file = run.folder / dataset_file_name;
    std::error_code unseen;
    if (const auto dataset = DatasetReader::open(file)) {
      const auto bytes = std::filesystem::file_size(file, unseen);
      done = store_->publish_dataset({run.entry.rig, run.entry.run, run.dataset_sha256,
                                      static_cast<std::int64_t>(dataset->listed().trials.size()),
                                      static_cast<std::int64_t>(bytes), file.string()});
      if (done) done = store_->publish_trials(run.entry.rig, run.entry.run, trials_of(*dataset));
    }
    const auto certificate = read_text_file(run.folder / certificate_file_name, most_list_bytes);
    if (done && certificate)
      done = store_->publish_certificate(
          {run.entry.rig, run.entry.run, sha256_hex(*certificate), *certificate});
  }
  // A publication that is refused for good would block all that follow.
  if (!done && !is_refused_for_good(done.error(), store_->sqlstate())) return done;
  {
    const std::lock_guard lock(mutex_);
    const auto waiting = requests_.runs.find(run.change.run);
    if (waiting != requests_.runs.end() &&
        waiting->second.change.revision_us <= run.change.revision_us)
      requests_.runs.erase(waiting);
  }
  context_.post([this, change = run.change, done] { reports_.on_published(change, done); });
  return {};
}

Status LabWorker::settle(const Requests& requests) {
  if (!requests.settlement) return {};
  const auto& [part, result] = *requests.settlement;
  const Status done = result ? store_->finish(part, *result) : store_->give_back(part);
  if (!done && !is_refused_for_good(done.error(), store_->sqlstate())) return done;
  {
    const std::lock_guard lock(mutex_);
    requests_.settlement.reset();
  }
  renewing_.reset();
  context_.post([this, held = part, done] { reports_.on_settled(held, done); });
  return {};
}

Status LabWorker::renew(const Requests& requests) {
  if (!requests.held) return {};
  if (!renewing_ || !is_same(*renewing_, *requests.held)) {  // just claimed, or after a restart
    renewing_ = requests.held;
    renewed_ = {};
  }
  if (!is_due(renewed_, context_.lease / 3)) return {};
  const auto renewed = store_->renew(*requests.held, context_.lease);
  if (!renewed && !is_refused_for_good(renewed.error(), store_->sqlstate()))
    return pass(renewed.error());
  renewed_ = steady_wall_now();
  if (renewed) {
    context_.post([this, part = *requests.held, cancelled = renewed->is_cancelled] {
      reports_.on_renewed(part, cancelled);
    });
    return {};
  }
  {
    const std::lock_guard lock(mutex_);
    if (requests_.held && is_same(*requests_.held, *requests.held)) requests_.held.reset();
  }
  context_.post(
      [this, part = *requests.held, why = renewed.error()] { reports_.on_lost(part, why); });
  return {};
}

Status LabWorker::claim(const Requests& requests) {
  if (!requests.claim || requests.settlement || requests.held || !published_rig_) return {};
  if (!is_due(claimed_, claim_period)) return {};
  const auto part = store_->claim(published_rig_->name, *requests.claim, context_.lease);
  if (!part) return pass(part.error());
  claimed_ = steady_wall_now();
  if (!*part) return {};
  {
    const std::lock_guard lock(mutex_);
    requests_.claim.reset();
    requests_.held = (*part)->lease;
  }
  renewing_ = (*part)->lease;
  renewed_ = claimed_;
  context_.post([this, claimed = **part] { reports_.on_claimed(claimed); });
  return {};
}

Status LabWorker::read_rigs(const Requests& requests) {
  if (requests.rigs_wanted_until < steady_wall_now() || !is_due(rigs_read_, rigs_period)) return {};
  auto rigs = store_->rigs();
  if (!rigs) return pass(rigs.error());
  for (RigEntry& rig : *rigs) rig.status_json = bounded_status(rig.status_json);
  rigs_read_ = steady_wall_now();
  const std::lock_guard lock(mutex_);
  rigs_ = {std::move(*rigs), context_.utc_us()};
  return {};
}

}  // namespace weft::daemon::lab
