#pragma once
// What the methods of the API work on, and the methods themselves by groups. Source: docs/api.md.

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
#include "daemon/service/methods/data_files.hpp"
#include "daemon/service/rpc/event_hub.hpp"
#include "daemon/service/rpc/leases.hpp"
#include "daemon/service/rpc/method.hpp"
#include "daemon/service/runs/run_manager.hpp"

namespace weft::daemon::api {

/// Looks the file over as recipe.check does, short of what a recipe has to do with it; again only
/// once its text, or that of its cloth table, is another, or there are other plugins.
class RigWatch {
 public:
  /// Sentences; none where the rig can be run.
  const std::vector<std::string>& problems(const std::filesystem::path& file,
                                           const std::string& text);

 private:
  std::optional<RigFile> rig_;  ///< as it was looked at; none where it could not be read
  std::optional<std::string> text_, fabrics_;
  std::vector<std::filesystem::path> plugins_;  ///< that there were, and their folders
  std::vector<std::string> problems_;
};

/// Outlives the methods. Used by the server's thread alone.
struct Services {
  server::Hub* hub = nullptr;
  access::Leases* leases = nullptr;
  runs::RunManager* run_manager = nullptr;
  handover::HandoverService* handovers = nullptr;
  runs::RunStore* log = nullptr;
  std::filesystem::path rig;  ///< rig file
  std::shared_ptr<RigWatch> rig_watch = std::make_shared<RigWatch>();
  std::string rig_name;           ///< "rig:" + this is the scope of its lease
  std::filesystem::path recipes;  ///< folder of *.json
  std::filesystem::path data;
  std::string epoch;
  std::function<std::chrono::nanoseconds()> now;  ///< monotonic
  std::function<std::int64_t()> utc_us;
  /// Long work, done on another thread; what it returns is called on the server's, or `failed`
  /// where it threw. False where too much waits already.
  using Report = std::function<void()>;
  using BackgroundTask =
      std::function<bool(std::function<Report()> work, std::function<void(const Error&)> failed)>;
  BackgroundTask background;
  BackgroundTask
      change_background;  ///< likewise, of who wants a run to begin: no question makes him wait
  BackgroundTask file_background;  ///< on a thread of its own again, the only one that uses `files`
  DataFiles* files = nullptr;      ///< the data sets' files
  BenchPace* pace = nullptr;       ///< of a simulated bench
  const LiveFrameSampler* frame_sampler = nullptr;
  server::Sessions* sessions = nullptr;
  /// A new token, kept. Errors: TokenFile's.
  std::function<Result<std::string>(std::string name, access::Role role, std::int64_t expires_us,
                                    std::string user)>
      add_token = {};
  std::function<Status(std::string_view name)> remove_token = {};
  /// Why the file of tokens cannot be read; nothing where it can.
  std::function<std::optional<Error>()> tokens_problem = {};
  bool one_run = false;  ///< the daemon inside `weft run`: nothing but that run is its business
  std::string http_url = {};  ///< "http://127.0.0.1:8080"; empty where HTTP is not served
};

/// All of them, with the introduction.
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
void add_sim_methods(rpc::Methods& methods, const Services& services);
void add_session_methods(rpc::Methods& methods, const Services& services);
void add_subscription_methods(rpc::Methods& methods, const Services& services);

/// Publishes the newest frame of the run under way under "stream:force", "stream:stages" and
/// "stream:taxels", where a client subscribes to one. Call each tick: the run pays for at most one
/// frame, however many subscribe.
void publish_samples(server::Hub& hub, LiveFrameSampler& sampler, const runs::RunManager& manager,
                     std::int64_t t_us);

/// A file by "R-000318/dataset.h5", for a download: `callback` is called once, on the server's
/// thread. Errors: not_found; DataFiles::open()'s; timeout, when too many wait already.
void open_served_file(const Services& services, std::string_view path,
                      const std::function<void(const Result<server::ServedFile>&)>& callback);
/// {ok, blockers: [{kind, where, hint}]}: all that keeps a run from being started now.
std::string readiness_json(const Services& services);
/// While a run is under way its user's lease is kept, from the first change of the run to its end.
void keep_lease(const Services& services, const runs::RunView& run);
/// Its time is over: in the journal, then told.
void notify_lease_expired(const Services& services, const access::Lease& lease);
/// What "rig" events carry: how the rig stands by now, and by whose word or act; null where a
/// reason is gone.
nlohmann::json rig_delta(const runs::RunManager& manager, std::string_view by);
/// What rig.state answers: "rig" is safe, holding, moving, unknown or latched.
nlohmann::json rig_json(const runs::RunManager& manager);
/// The topics "run:ID" of all runs, for the hub. `services` outlives it.
server::Hub::Archive run_archive(const Services& services);
/// A run for a client; also what "run:ID" events carry.
nlohmann::json run_json(const runs::RunView& run);
/// What "queue" events carry: the runs that wait, the next first.
nlohmann::json queue_json(const runs::RunQueue& queue);
/// The accuracies of a run, as headline_json() has them; null where it was not evaluated.
nlohmann::json result_json(const runs::RunView& run);
/// What a run says of its hand-over.
nlohmann::json handover_json(const HandoverStatus& fact);
/// What "vote:ID" events carry.
nlohmann::json vote_json(const LiveVoteUpdate& vote);

}  // namespace weft::daemon::api
