#include "daemon/service/lab/lab_store.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/service/lab/lab_schema.hpp"

namespace weft::daemon::lab {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;

constexpr milliseconds first_retry{500}, longest_retry{60'000};
/// Lock of the transaction that installs; any number that no other program uses.
constexpr std::int64_t install_lock = 0x77656674;

std::optional<std::int64_t> signed_seed(const std::optional<std::uint64_t>& seed) {
  if (!seed) return std::nullopt;
  return static_cast<std::int64_t>(*seed);
}

int newest_version() {
  return migrations().back().version;
}

tl::unexpected<Error> fail_version(const LabAddress& address, std::int64_t found) {
  const bool is_newer = found > newest_version();
  return fail({.code = Errc::unsupported,
               .where = address.text(),
               .what = is_newer ? "schema of the store is newer than this program"
                                : "schema of the store is older than this program",
               .expected = "version " + std::to_string(newest_version()),
               .got = "version " + std::to_string(found),
               .hint = is_newer ? "Update Weft on this computer"
                                : "An administrator updates the schema: weft lab install --lab "
                                  "URI. Then update the other computers"});
}

std::string batch_json(const std::vector<TrialEntry>& trials, std::size_t from, std::size_t to) {
  json list = json::array();
  for (std::size_t i = from; i < to; ++i) {
    const TrialEntry& trial = trials[i];
    list.push_back({{"index", trial.index},
                    {"label", trial.label},
                    {"exploration", trial.exploration},
                    {"repetition", trial.repetition},
                    {"outcome", trial.outcome},
                    {"sha256", trial.sha256}});
  }
  return list.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

Result<Connection> LabStore::connect(const LabAddress& address, std::string_view program,
                                     const PostgresLimits& limits) {
  auto made = Connection::open(address, program, limits);
  if (!made) return made;
  const auto version = made->run("SELECT coalesce(max(version), 0) FROM weft.migration");
  if (!version) {
    if (made->sqlstate() == "42P01")
      return fail({.code = Errc::not_found,
                   .where = address.text(),
                   .what = "database has no schema of Weft",
                   .hint = "An administrator installs it: weft lab install --lab URI"});
    return pass(version.error());
  }
  const std::int64_t found = version->integer(0, 0);
  if (found != newest_version()) return fail_version(address, found);
  return made;
}

Result<LabStore> LabStore::open(LabAddress address, std::string program,
                                const PostgresLimits& limits) {
  auto made = connect(address, program, limits);
  if (!made) return pass(made.error());
  LabStore store(std::move(address), std::move(program), limits);
  store.connection_ = std::move(*made);
  if (Status read = store.read_id(); !read) return pass(read.error());
  return store;
}

Result<std::vector<int>> LabStore::install(const LabAddress& address,
                                           const PostgresLimits& limits) {
  auto made = Connection::open(address, "lab install", limits);
  if (!made) return pass(made.error());
  Connection& connection = *made;
  std::vector<int> applied;
  const auto apply = [&]() -> Status {
    if (auto locked = connection.run("SELECT pg_advisory_xact_lock($1)", install_lock); !locked)
      return pass(locked.error());
    const auto exists = connection.run("SELECT to_regclass('weft.migration') IS NOT NULL");
    if (!exists) return pass(exists.error());
    std::int64_t found = 0;
    if (exists->flag(0, 0)) {
      const auto version = connection.run("SELECT coalesce(max(version), 0) FROM weft.migration");
      if (!version) return pass(version.error());
      found = version->integer(0, 0);
    }
    if (found > newest_version()) return fail_version(address, found);
    for (const Migration& each : migrations()) {
      if (each.version > 0 && each.version <= found) continue;
      if (Status done = connection.run_script(std::string(each.sql)); !done)
        return pass(done.error(), each.name);
      if (each.version == 0) {
        if (auto owner = connection.run("SET LOCAL ROLE weft_owner"); !owner)
          return pass(owner.error());
        continue;
      }
      applied.push_back(each.version);
    }
    return {};
  };
  if (const Status done = connection.transact(apply); !done) return pass(done.error());
  return applied;
}

Status LabStore::reconnect() {
  if (is_connected()) return {};
  auto made = connect(address_, program_, limits_);
  if (made)
    for (const std::string& channel : channels_)
      if (const Status done = made->listen(channel); !done) made = pass(done.error());
  if (!made) {
    retry_wait_ = std::clamp(2 * retry_wait_, first_retry, longest_retry);
    return pass(made.error());
  }
  connection_ = std::move(*made);
  retry_wait_ = milliseconds(0);
  return read_id();
}

Result<Rows> LabStore::run_bound(const std::string& sql, const std::vector<BoundText>& values) {
  return connection_->run_bound(sql.c_str(), values);
}

Status LabStore::read_id() {
  const auto rows = run("SELECT id FROM weft.store");
  if (!rows) return pass(rows.error());
  id_ = rows->size() == 1 ? rows->text(0, 0) : std::string();
  return {};
}

Status LabStore::publish_rig(const RigEntry& rig) {
  return change("SELECT weft.publish_rig($1, $2, $3, $4, $5, $6, $7)", rig.name, rig.address,
                to_string(rig.bench), rig.state, rig.rig_sha256, rig.status_json,
                rig.instance.empty() ? std::nullopt : std::optional(rig.instance));
}

Status LabStore::publish_run(const RunEntry& run) {
  return change(
      "SELECT weft.publish_run($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14)",
      run.rig, run.run, run.recipe, run.recipe_sha256, signed_seed(run.seed), run.fabrics,
      to_string(run.bench), run.state, run.trials_planned, run.trials_complete, run.started_us,
      run.ended_us, run.place, run.revision_us);
}

Status LabStore::publish_dataset(const DatasetEntry& dataset) {
  return change("SELECT weft.publish_dataset($1, $2, $3, $4, $5, $6)", dataset.rig, dataset.run,
                dataset.dataset_sha256, dataset.trials, dataset.bytes, dataset.place);
}

Status LabStore::publish_certificate(const CertificateEntry& certificate) {
  return change("SELECT weft.publish_certificate($1, $2, $3, $4)", certificate.rig, certificate.run,
                certificate.certificate_sha256, certificate.json);
}

Status LabStore::publish_trials(std::string_view rig, std::string_view run_id,
                                const std::vector<TrialEntry>& trials) {
  constexpr std::size_t batch = 5000;
  for (std::size_t from = 0; from < trials.size(); from += batch) {
    const std::string json_text = batch_json(trials, from, std::min(trials.size(), from + batch));
    if (Status done = change("SELECT weft.publish_trials($1, $2, $3)", rig, run_id, json_text);
        !done)
      return done;
  }
  return {};
}

Status LabStore::listen(std::string_view channel) {
  if (Status done = connection_->listen(channel); !done) return done;
  if (std::ranges::find(channels_, channel) == channels_.end()) channels_.emplace_back(channel);
  return {};
}

Result<std::optional<Notification>> LabStore::wait(milliseconds longest) {
  return connection_->wait(longest);
}

}  // namespace weft::daemon::lab
