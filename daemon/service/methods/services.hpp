#pragma once
// Services that the API methods use, and the registration of the methods by group. Source:
// docs/reference/api.md.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/campaign/bench_pace.hpp"
#include "daemon/campaign/live_frame_sampler.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "daemon/service/handover/handover_service.hpp"
#include "daemon/service/lab_agent/lab_agent.hpp"
#include "daemon/service/methods/data_files.hpp"
#include "daemon/service/rpc/event_hub.hpp"
#include "daemon/service/rpc/leases.hpp"
#include "daemon/service/rpc/method.hpp"
#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::api {

/// Checks the rig file as recipe.check does, but without a recipe. Repeats the check only when its
/// text, its fabric table or the plugins have changed.
class RigWatch {
 public:
  /// Problems as sentences; empty if the rig can be run.
  const std::vector<std::string>& problems(const std::filesystem::path& file,
                                           const std::string& text);

 private:
  std::optional<RigFile> rig_;  ///< as last checked; none if it could not be read
  std::optional<std::string> text_, fabrics_;
  std::vector<std::filesystem::path> plugins_;  ///< plugins and their folders at the last check
  std::vector<std::string> problems_;
};

/// Must outlive the methods. Thread: the server's only.
struct Services {
  server::Hub* hub = nullptr;
  access::Leases* leases = nullptr;
  runs::RunManager* run_manager = nullptr;
  handover::HandoverService* handovers = nullptr;
  lab::LabAgent* lab = nullptr;  ///< none without --lab
  runs::RunStore* log = nullptr;
  std::filesystem::path rig;  ///< rig file
  std::shared_ptr<RigWatch> rig_watch = std::make_shared<RigWatch>();
  std::string rig_name;           ///< "rig:" + this is the scope of its lease
  std::filesystem::path recipes;  ///< folder of *.json
  std::filesystem::path data;
  std::string epoch;
  std::function<std::chrono::nanoseconds()> now;  ///< monotonic
  std::function<std::int64_t()> utc_us;
  /// Runs long work on another thread. The report that it returns is called on the server's thread,
  /// or `failed` if it threw. False if too much work is waiting.
  using Report = std::function<void()>;
  using BackgroundTask =
      std::function<bool(std::function<Report()> work, std::function<void(const Error&)> failed)>;
  BackgroundTask background;
  BackgroundTask change_background;  ///< as background, for starts of runs only: they do not wait
                                     ///< for other requests
  BackgroundTask file_background;    ///< as background, on a third thread, sole user of `files`
  DataFiles* files = nullptr;        ///< files of the data sets
  BenchPace* pace = nullptr;         ///< simulation speed of a simulated bench
  const LiveFrameSampler* frame_sampler = nullptr;
  server::Sessions* sessions = nullptr;
  /// Creates and stores a token. Errors: those of TokenFile.
  std::function<Result<std::string>(std::string name, access::Role role, std::int64_t expires_us,
                                    std::string user)>
      add_token = {};
  std::function<Status(std::string_view name)> remove_token = {};
  /// Why the token file cannot be read; empty if it can.
  std::function<std::optional<Error>()> tokens_problem = {};
  bool one_run = false;       ///< the daemon is part of `weft run` and serves that run only
  std::string http_url = {};  ///< "http://127.0.0.1:8080"; empty without HTTP
};

/// Adds all methods, including session.open.
void add_methods(rpc::Methods& methods, const Services& services);

void add_token_methods(rpc::Methods& methods, const Services& services);
void add_system_methods(rpc::Methods& methods, const Services& services);
void add_lease_methods(rpc::Methods& methods, const Services& services);
void add_recipe_methods(rpc::Methods& methods, const Services& services);
void add_run_methods(rpc::Methods& methods, const Services& services);
void add_queue_methods(rpc::Methods& methods, const Services& services);
void add_rig_methods(rpc::Methods& methods, const Services& services);
void add_data_methods(rpc::Methods& methods, const Services& services);
void add_trial_methods(rpc::Methods& methods, const Services& services);
void add_plan_methods(rpc::Methods& methods, const Services& services);
void add_sample_methods(rpc::Methods& methods, const Services& services);
void add_lab_methods(rpc::Methods& methods, const Services& services);
void add_sim_methods(rpc::Methods& methods, const Services& services);
void add_session_methods(rpc::Methods& methods, const Services& services);
void add_subscription_methods(rpc::Methods& methods, const Services& services);

/// Publishes the active run's newest frame as "stream:force", "stream:stages" and "stream:taxels",
/// if a client subscribes to one. Call each tick: costs the run at most one frame, for any number
/// of subscribers.
void publish_samples(server::Hub& hub, LiveFrameSampler& sampler, const runs::RunManager& manager,
                     std::int64_t t_us);

/// Opens a file for a download, by "R-000318/dataset.h5". `callback` is called once, on the
/// server's thread. Errors: not_found; those of DataFiles::open(); timeout, when too many wait
/// already.
void open_served_file(const Services& services, std::string_view path,
                      const std::function<void(const Result<server::ServedFile>&)>& callback);
/// {ok, blockers: [{kind, where, hint}]}: everything that prevents a run from starting now.
std::string readiness_json(const Services& services);
/// Keeps the lease of the run's user while the run is active, from its first change to its end.
void keep_lease(const Services& services, const runs::RunView& run);
/// Journals that the lease expired, then publishes it.
void notify_lease_expired(const Services& services, const access::Lease& lease);
/// Payload of "rig" events: the rig's state now and the cause `by`; null for reasons that no longer
/// apply.
nlohmann::json rig_delta(const runs::RunManager& manager, std::string_view by);
/// Answer of rig.state: "rig" is safe, holding, moving, unknown or latched.
nlohmann::json rig_json(const runs::RunManager& manager);
/// The topics "run:ID" of all runs, for the hub. `services` must outlive it.
server::Hub::Archive run_archive(const Services& services);
/// A run as JSON for clients; also the payload of "run:ID" events.
nlohmann::json run_json(const runs::RunView& run);
/// Payload of "queue" events: the queued runs, the next one first.
nlohmann::json queue_json(const runs::RunQueue& queue);
/// Accuracies of a run, as in headline_json(); null if it was not evaluated.
nlohmann::json result_json(const runs::RunView& run);
/// State of a run's handover.
nlohmann::json handover_json(const HandoverStatus& fact);
/// Payload of "vote:ID" events.
nlohmann::json vote_json(const LiveVoteUpdate& vote);

}  // namespace weft::daemon::api
