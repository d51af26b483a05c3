#pragma once
// The laboratory's shared store: rigs, runs, digests of data sets, and campaigns that are split
// into parts for several rigs. Tables, roles and functions: daemon/service/lab/schema. Source:
// docs/adr/0031-a-laboratory-store.md.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/base/text/format.hpp"
#include "daemon/service/lab/postgres.hpp"

namespace weft::daemon::lab {

// Publications of rigs. Times are UTC [us since 1970]; digests are SHA-256, 64 hexadecimal digits.

struct RigEntry {
  std::string name = {};
  std::string address = {};  ///< of its API: "tls://bench17:8443"
  BenchKind bench = BenchKind::unknown;
  std::string state = {};  ///< as `rig.state` of the API
  std::string rig_sha256 = {};
  /// One object: run, trial, trials, eta_s, next_action, alarms.
  std::string status_json = "{}";
  std::string login = {};    ///< set by the store: the login that owns the name
  std::int64_t seen_us = 0;  ///< set by the store: last publication
  /// Memory of the publishing daemon. Another one is refused until 30 s after the last publication.
  std::string instance = {};
};

struct RunEntry {
  std::string rig = {}, run = {};  ///< "bench17", "R-000318"
  std::string recipe = {};         ///< name
  std::string recipe_sha256 = {};
  std::optional<std::uint64_t> seed = {};  ///< up to recipes::largest_seed
  std::vector<std::string> fabrics = {};
  BenchKind bench = BenchKind::unknown;
  std::string state = {};  ///< RunState, or the outcome of an ended run
  std::int64_t trials_planned = 0, trials_complete = 0;
  std::int64_t started_us = 0;
  std::optional<std::int64_t> ended_us = {};
  std::string place = {};  ///< folder on the rig, or in a shared folder
  /// UTC of this state of the run [us]. An entry older than the stored one changes nothing.
  std::int64_t revision_us = 0;
  std::int64_t key = 0;  ///< set by the store: cursor of pages
};

struct DatasetEntry {
  std::string rig = {}, run = {}, dataset_sha256 = {};
  std::int64_t trials = 0, bytes = 0;
  std::string place = {};  ///< path or address of the file
};

struct CertificateEntry {
  std::string rig = {}, run = {}, certificate_sha256 = {}, json = {};
};

struct TrialEntry {
  std::int64_t index = 0;
  std::string label = {}, exploration = {};
  std::int64_t repetition = 0;
  std::string outcome = {};
  std::string sha256 = {};  ///< of its samples; empty without any
};

// Queries.

struct RunsFilter {
  std::string rig = {}, recipe = {}, state = {};             ///< empty: any
  BenchKind bench = BenchKind::unknown;                      ///< unknown: any
  std::optional<std::int64_t> since_us = {}, until_us = {};  ///< start in [since, until)
};
struct RunsPage {
  std::vector<RunEntry> runs = {};        ///< newest start first
  std::optional<std::int64_t> next = {};  ///< key for `after`, if more runs follow
};
/// All given conditions must hold.
struct LabSearch : RunsFilter {
  std::string text = {};    ///< words in rig, run, recipe, fabrics or place; case is ignored
  std::string fabric = {};  ///< whole name
  std::string digest = {};  ///< first 4 to 64 digits, of recipe, data set, certificate or trial
};

// Campaigns over several rigs.

enum class PartState : std::uint8_t { queued, held, done, failed, cancelled };
std::string_view to_string(PartState state);

struct CampaignRequestEntry {
  std::string name = {}, recipe_text = {}, recipe_sha256 = {};
  std::optional<std::uint64_t> seed = {};
  std::string parameters_json = "{}";
  std::vector<std::string> fabrics = {};  ///< one part each
  std::vector<std::string> rigs = {};     ///< that may take the parts
  /// A repeated submission with the same key returns the first campaign. Empty: always a new one.
  std::string key = {};
};
struct PartEntry {
  std::int64_t number = 0;  ///< from 1
  std::string fabric = {};
  std::vector<std::string> rigs = {};
  PartState state = PartState::queued;
  std::string holder = {};               ///< rig of the newest attempt; empty if none
  BenchKind bench = BenchKind::unknown;  ///< of the holder
  std::int64_t attempt = 0;              ///< claims so far
  std::optional<std::int64_t> lease_until_us = {};
  bool lease_expired = false;  ///< held, and free for the next claim
  std::string run = {}, dataset_sha256 = {}, error = {};
};
struct LabCampaign {
  std::int64_t id = 0;
  std::string name = {}, recipe_text = {}, recipe_sha256 = {}, parameters_json = {},
              submitted_by = {};
  std::optional<std::uint64_t> seed = {};
  std::string state = {};  ///< queued, running, done, failed, cancelled
  std::int64_t submitted_us = 0;
  std::vector<PartEntry> parts = {};
};
/// "C-000012", and back; empty for any other text.
std::string campaign_text(std::int64_t id);
std::optional<std::int64_t> campaign_number(std::string_view text);

/// Limits of the parts that a rig can take.
struct RigCapabilities {
  std::vector<std::string> fabrics = {};             ///< it can mount; empty: any
  std::vector<std::int64_t> refused_campaigns = {};  ///< with recipes that do not fit it
};
/// Identifies a held part. The token is secret: only this rig has it.
struct PartLease {
  std::int64_t campaign = 0, number = 0;
  std::string token = {};
};
struct ClaimedPart {
  PartLease lease;
  std::int64_t lease_until_us = 0, attempt = 0;
  std::string campaign_name = {}, fabric = {}, recipe_text = {}, recipe_sha256 = {},
              parameters_json = {};
  std::optional<std::uint64_t> seed = {};
};
struct RenewedLease {
  std::int64_t lease_until_us = 0;
  bool is_cancelled = false;  ///< a person cancelled the campaign; the part may still be finished
};
struct PartResult {
  bool is_done = true;  ///< false: failed for good, with `error`
  std::string run = {}, dataset_sha256 = {}, error = {};
};

/// A connection to the store. Thread: one, a worker: each call waits up to the limits of
/// PostgresLimits. Errors of all calls: those of Connection.
class LabStore {
 public:
  /// Connects and compares the schema. Errors also: not_found, no schema; unsupported, the schema
  /// is newer or older than this program.
  static Result<LabStore> open(LabAddress address, std::string program,
                               const PostgresLimits& limits = {});
  /// Makes roles, schema and missing migrations in one transaction, as an administrator. Returns
  /// the applied versions; empty if the schema was current. Errors also: unsupported, a newer
  /// schema.
  static Result<std::vector<int>> install(const LabAddress& address,
                                          const PostgresLimits& limits = {});

  /// Identity of the store, made at its installation.
  [[nodiscard]] const std::string& id() const { return id_; }
  [[nodiscard]] bool is_connected() const { return connection_ && connection_->is_open(); }
  /// One attempt to connect after a lost connection; channels are listened to again. A failure
  /// doubles retry_wait(), up to a minute. Does nothing while connected.
  Status reconnect();
  /// Wait before the next reconnect(); 0 while connected.
  [[nodiscard]] std::chrono::milliseconds retry_wait() const { return retry_wait_; }

  // For rigs. A repeated publication changes nothing. Errors also: wrong_state, if the rig's name
  // belongs to another login.
  Status publish_rig(const RigEntry& rig);
  Status publish_run(const RunEntry& run);
  Status publish_dataset(const DatasetEntry& dataset);
  Status publish_certificate(const CertificateEntry& certificate);
  /// Any number; sent in batches, each of which is stored whole or not at all.
  Status publish_trials(std::string_view rig, std::string_view run,
                        const std::vector<TrialEntry>& trials);

  /// The oldest part that this rig may take: queued, or held with an expired lease. It is held for
  /// `lease` from now on the server's clock. Nothing if there is none.
  Result<std::optional<ClaimedPart>> claim(std::string_view rig, const RigCapabilities& can,
                                           std::chrono::seconds lease);
  /// Errors of these three also: wrong_state, the lease was lost to another rig; nothing changes.
  Result<RenewedLease> renew(const PartLease& part, std::chrono::seconds lease);
  /// Repeating the same result with the same token changes nothing.
  Status finish(const PartLease& part, const PartResult& result);
  Status give_back(const PartLease& part);

  // For submitters.
  /// Returns the campaign's id. Errors also: not_found, unknown rigs.
  Result<std::int64_t> submit(const CampaignRequestEntry& request);
  /// Removes the queued parts of an own campaign. Held parts may be finished.
  Status cancel(std::int64_t campaign);

  // For readers.
  Result<std::vector<RigEntry>> rigs();  ///< by name
  /// The first page without `after`. `limit`: 1 to 1000.
  Result<RunsPage> runs(const RunsFilter& filter, std::optional<std::int64_t> after,
                        std::size_t limit);
  Result<std::vector<RunEntry>> search(const LabSearch& search, std::size_t limit);
  /// Data sets by the beginning of their digest, 4 to 64 digits; several runs may have the same.
  Result<std::vector<DatasetEntry>> datasets(std::string_view digest);
  Result<LabCampaign> campaign(std::int64_t id);

  /// Receives "weft_parts" (submitted or given back) or "weft_rigs" (a rig changed).
  Status listen(std::string_view channel);
  Result<std::optional<Notification>> wait(std::chrono::milliseconds longest);
  /// One round trip to the server.
  Status ping() { return change("SELECT 1"); }
  /// SQLSTATE of the last error of the server, see Connection::sqlstate().
  [[nodiscard]] std::string sqlstate() const { return connection_ ? connection_->sqlstate() : ""; }

 private:
  LabStore(LabAddress address, std::string program, const PostgresLimits& limits)
      : address_(std::move(address)), program_(std::move(program)), limits_(limits) {}
  /// Connects, and compares the schema.
  static Result<Connection> connect(const LabAddress& address, std::string_view program,
                                    const PostgresLimits& limits);
  Status read_id();
  template <class... Values>
  Result<Rows> run(const char* sql, const Values&... values) {
    return run_bound(sql, std::vector<BoundText>{bound(values)...});
  }
  Result<Rows> run_bound(const std::string& sql, const std::vector<BoundText>& values);
  /// For statements without a result.
  template <class... Values>
  Status change(const char* sql, const Values&... values) {
    if (const auto done = run(sql, values...); !done) return pass(done.error());
    return {};
  }

  LabAddress address_;
  std::string program_;
  PostgresLimits limits_;
  std::optional<Connection> connection_;
  std::string id_;
  std::vector<std::string> channels_;
  std::chrono::milliseconds retry_wait_{0};
};

}  // namespace weft::daemon::lab
