#pragma once
// A daemon in its laboratory: publishes rig and runs to the shared store, and takes parts of
// campaigns while an operator of the rig accepts them. Without the store the rig works on; what it
// owes is published later. Source: docs/adr/0031-a-laboratory-store.md.

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "daemon/service/lab_agent/lab_worker.hpp"
#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::lab {

/// Parts of the daemon that the agent uses; they must outlive it.
struct LabAgentContext {
  LabAddress address;
  std::string rig_name;
  std::string api_address;    ///< where its API is reached: "tls://bench17:8443", "unix:/run/..."
  std::string http_url = {};  ///< of its files: "https://bench17:8080"; empty without HTTP
  std::filesystem::path rig, data;
  runs::RunManager* manager = nullptr;
  runs::RunStore* store = nullptr;
  std::function<void(std::function<void()>)> post;
  std::function<std::int64_t()> utc_us;
  std::function<std::chrono::nanoseconds()> now;
  std::function<std::string()> rig_text;  ///< as in `rig.state`
  /// The present lease of the rig: its id and its user; empty: none.
  struct LeaseHolder {
    std::string lease, user;
  };
  std::function<LeaseHolder()> lease_holder;
  /// Runs work on another thread, then its report on the server's thread; see api::Services.
  std::function<bool(std::function<std::function<void()>()>, std::function<void(const Error&)>)>
      background;
  std::chrono::seconds lease{60};  ///< of a part
};

/// Thread: the server's.
class LabAgent {
 public:
  /// Errors: io, from weftd.sqlite. A store that cannot be reached is no error.
  static Result<std::unique_ptr<LabAgent>> open(LabAgentContext context);
  ~LabAgent();
  LabAgent(const LabAgent&) = delete;
  LabAgent& operator=(const LabAgent&) = delete;

  void on_run(const runs::RunView& run);
  /// Call often.
  void tick();
  /// Call when the daemon ends: gives the part back if its run has not begun.
  void close();

  /// This rig takes parts from now on, until this lease of it ends. Errors: wrong_state, if it is
  /// not the present one.
  Status accept(const std::string& lease);
  /// No further part is taken; a running one goes on.
  void withdraw(std::string_view by);

  /// {rig, store, connected, error, reached_us, unpublished, accepted_by, part}
  [[nodiscard]] nlohmann::json status_json();
  /// {rigs: [...], at_us, connected, error}: all rigs of the laboratory as last read.
  [[nodiscard]] nlohmann::json rigs_json();

 private:
  LabAgent(LabAgentContext context, LabOutbox outbox);
  /// Sends what the outbox holds to the worker.
  void send_changed_runs();
  void publish_rig();
  /// True while the lease that accepted parts is the present one.
  [[nodiscard]] bool is_accepted() const;
  /// True if a run would start at once.
  [[nodiscard]] bool is_free() const;
  void on_claimed(const ClaimedPart& part);
  void start(const ClaimedPart& part, const runs::RunRequest& request,
             const runs::Checked& checked);
  void refuse(const ClaimedPart& part, const Error& why);
  /// Settles the held part if its run is over.
  void settle_ended();
  void forget_part();
  void on_settled(const PartLease& part, const Status& done);
  void journal(std::string_view run, std::string_view kind, std::string_view by,
               const nlohmann::json& payload);
  [[nodiscard]] bool is_held(const PartLease& lease) const;
  [[nodiscard]] RunPublication publication_of(const runs::RunView& run,
                                              const UnpublishedRun& change) const;

  const LabAgentContext context_;
  LabOutbox outbox_;
  LabAgentContext::LeaseHolder accepted_;  ///< empty: no part is taken
  std::uint64_t publications_refused_ = 0;
  std::string newest_refusal_;
  std::optional<std::chrono::nanoseconds> ended_at_;  ///< the part's run, as first noticed
  std::optional<HeldPart> part_;
  bool is_lost_ = false;      ///< the part belongs to another rig now
  bool is_settling_ = false;  ///< its result is on the way to the store
  std::set<std::int64_t> refused_campaigns_;
  std::chrono::nanoseconds claims_after_{};
  std::map<std::int64_t, std::string> run_states_;  ///< as last marked
  std::map<std::int64_t, std::int64_t> sent_;       ///< revision of each run
  std::string rig_sha256_, instance_;
  std::optional<std::chrono::nanoseconds> rig_published_;
  bool closing_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  std::unique_ptr<LabWorker> worker_;  // last: its reports use all of the above
};

}  // namespace weft::daemon::lab
