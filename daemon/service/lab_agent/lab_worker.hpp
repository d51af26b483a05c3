#pragma once
// The thread of a daemon that talks to the laboratory's store. The server's thread states what it
// wants and never waits; reports come back through `post`.

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/service/lab/lab_store.hpp"
#include "daemon/service/lab_agent/lab_outbox.hpp"

namespace weft::daemon::lab {

/// One run to publish. Data set, certificate and trials are read from `folder` if the run has a
/// data set.
struct RunPublication {
  UnpublishedRun change;
  RunEntry entry;
  std::filesystem::path folder = {};
  std::string dataset_sha256 = {};  ///< empty: no data set
};

/// Called on the server's thread.
struct LabReports {
  /// The store has the run, or has refused it for good.
  std::function<void(const UnpublishedRun&, const Status&)> on_published;
  /// After each connection, with the store's identity.
  std::function<void(const std::string& store)> on_connected;
  std::function<void(const ClaimedPart&)> on_claimed;
  std::function<void(const PartLease&, bool is_cancelled)> on_renewed;
  /// The lease belongs to another rig now, or was finished.
  std::function<void(const PartLease&, const Error&)> on_lost;
  /// The store has the result, or has refused it for good.
  std::function<void(const PartLease&, const Status&)> on_settled;
};

/// State of the connection, for clients.
struct LabConnection {
  bool is_connected = false;
  std::string error = {};     ///< of the last failure; empty if there was none since it connected
  std::int64_t since_us = 0;  ///< UTC of the last answer of the store; 0: none yet
};

struct LabWorkerContext {
  LabAddress address;
  std::string program;  ///< "weftd bench17"
  std::function<void(std::function<void()>)> post;
  std::function<std::int64_t()> utc_us;
  std::chrono::seconds lease{60};  ///< of a part; renewed at a third of it
};

/// Text of a rig's status with the keys, types and sizes that a daemon publishes, or "null". The
/// store accepts any object from a rig's login.
std::string bounded_status(const std::string& status_json);

/// All functions: any thread; they return at once.
class LabWorker {
 public:
  LabWorker(LabWorkerContext context, LabReports reports);
  ~LabWorker();  ///< waits for the current call, at most as long as PostgresLimits allow

  /// Published when it differs from the last one, and every 10 s.
  void set_rig(RigEntry rig);
  /// Replaces an earlier, waiting publication of the run.
  void publish(RunPublication run);
  /// Nothing: no part is claimed.
  void set_claim(std::optional<RigCapabilities> can);
  /// The part that is renewed; nothing: none.
  void set_held(std::optional<PartLease> part);
  /// Tried until the store answers. Without a result the part is given back.
  void settle(const PartLease& part, std::optional<PartResult> result);

  [[nodiscard]] LabConnection connection() const;
  /// The rigs of the laboratory, as read in the last seconds; a call keeps them fresh for 10 s.
  struct Rigs {
    std::vector<RigEntry> rigs;
    std::int64_t at_us = 0;  ///< UTC; 0: not read yet
  };
  Rigs rigs();

 private:
  struct Settlement {
    PartLease part;
    std::optional<PartResult> result;
  };
  /// Orders of the server's thread.
  struct Requests {
    std::optional<RigEntry> rig;
    std::map<std::int64_t, RunPublication> runs;
    std::optional<RigCapabilities> claim;
    std::optional<PartLease> held;
    std::optional<Settlement> settlement;
    std::chrono::nanoseconds rigs_wanted_until{};
  };
  using Clock = std::chrono::nanoseconds;

  void work(const std::stop_token& stop);
  bool connect(const std::stop_token& stop);
  /// One round. False: the connection was lost.
  Status round();
  Status publish_rig(const Requests& requests);
  Status publish_one(const RunPublication& run);
  Status renew(const Requests& requests);
  Status settle(const Requests& requests);
  Status claim(const Requests& requests);
  Status read_rigs(const Requests& requests);
  void wait(const std::stop_token& stop, std::chrono::milliseconds longest);
  void note(const Status& done);

  const LabWorkerContext context_;
  const LabReports reports_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  Requests requests_;
  LabConnection connection_;
  Rigs rigs_;
  // Only the worker's own thread uses these.
  std::optional<LabStore> store_;
  std::optional<RigEntry> published_rig_;
  std::string rig_refusal_;  ///< why the store does not take the rig; empty: it does
  Clock rig_published_{}, renewed_{}, claimed_{}, rigs_read_{};
  std::optional<PartLease> renewing_;
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace weft::daemon::lab
