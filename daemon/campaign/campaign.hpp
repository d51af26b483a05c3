#pragma once
// One campaign from recipe to data set: check, bring the bench up, run, record, export.

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "daemon/campaign/bench_pace.hpp"
#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/error_check.hpp"
#include "daemon/campaign/live_classifier.hpp"
#include "daemon/campaign/live_frame_sampler.hpp"
#include "daemon/campaign/orders/run_orders.hpp"
#include "daemon/campaign/simulation.hpp"
#include "daemon/campaign/trial_recording.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {

struct CampaignRequest {
  std::filesystem::path recipe;  ///< its folder is also that of its models
  std::filesystem::path rig;
  std::filesystem::path out;  ///< folder for campaign.sqlite and dataset.h5; created if missing
  std::optional<std::uint64_t> seed;  ///< replaces the recipe's
  FidelityRequest fidelity = {};
  bool error_check = true;  ///< simulate some trials again at a finer setting after the last trial
  PluginSettings plugins = {};  ///< in addition to those of the rig file
  /// Resumes the campaign in `out`, or starts it if nothing is on record yet.
  bool resume = false;
  /// Output of `weft align --json` with the plate tilt to compensate. Empty: the rig file as it is.
  /// A resumed campaign uses the same file, whatever its age.
  std::filesystem::path level = {};
  /// Maximum age of `level`; zero: any age.
  std::chrono::seconds oldest_level = std::chrono::hours(24);
  /// Replaces the present content of the recipe's file.
  std::optional<std::string> recipe_text = {};
  /// The recipe's parameters, {NAME: value}; empty: their defaults.
  std::string parameters_json = {};
  /// Only the trials on this fabric of the recipe are run, see recipes::part_on(); nothing: all.
  std::optional<std::string> only_fabric = {};
  /// With `resume`: an ended campaign is accepted, and its summary comes from its file. Otherwise
  /// it is refused, because nothing is left. A daemon may die between a campaign's end and its own
  /// record of it.
  bool accept_whole = false;
};

/// Wall time of the run by part, estimated by sampling [s].
struct WallTimeBreakdown {
  double plant_and_emulators_s = 0;
  double drivers_and_control_s = 0;
  double recorder_s = 0;
  double export_s = 0;
  double error_check_s = 0;  ///< measured; not part of the run's wall time
};

/// One line of progress, after each trial.
struct TrialProgress {
  std::size_t done = 0;
  std::size_t planned = 0;
  std::string fabric;
  std::string exploration;
  std::uint32_t repetition = 0;
  recipes::Outcome outcome = recipes::Outcome::complete;
  std::optional<Error> error;               ///< reason if it is not complete
  std::size_t attempts_rejected = 0;        ///< of the campaign so far
  std::optional<double> force_rms_error_n;  ///< phase M; none without a force sample in it
  std::uint64_t frames_lost = 0;            ///< of the campaign so far [count]
  /// Longest commit since the previous line; none without a commit.
  std::optional<double> recorder_lag_s;
  double virtual_s = 0;  ///< of the campaign so far
  double wall_s = 0;
  std::optional<double> wall_left_s;  ///< RunForecast::left_s()
};

struct CampaignSummary {
  std::string name;
  BenchKind bench = BenchKind::unknown;
  std::string level;  ///< fidelity level of the plant, empty on a real bench
  SimulationNote simulation;
  recipes::Outcome outcome = recipes::Outcome::complete;
  recipes::Cleanup cleanup = recipes::Cleanup::done;
  recipes::RigFact rig = recipes::RigFact::safe;
  std::optional<Error> error;  ///< the first failure
  /// Why file, data set or certificate could not be finished after the bench had ended. Independent
  /// of the three facts above.
  std::optional<Error> dataset_error;
  std::size_t trials_planned = 0;
  std::size_t trials_complete = 0;  ///< includes trials with a stroke that ended early
  std::size_t trials_ended_early = 0;
  /// Rejected ones, kept beside the accepted ones that followed.
  std::size_t attempts_rejected = 0;
  double forecast_s = 0;  ///< of the plan
  double virtual_s = 0;   ///< time on the bench's clock
  double bring_up_s = 0;  ///< part of `virtual_s` for opening and homing; not in the forecast
  double wall_s = 0;      ///< bring-up, run and recording, without the export
  ForceTally force;       ///< phase M of all complete trials
  std::string dataset_sha256;
  std::filesystem::path campaign_file;
  std::filesystem::path dataset_file;
  WallTimeBreakdown time;
  std::uint64_t events = 0;      ///< callbacks of the virtual loop
  bool has_handover = false;     ///< it is evaluated when complete
  bool states_handover = false;  ///< because its recipe requests it
};

/// ", 12 of them with slides that ended early, which are in no data set"; empty without such
/// trials.
std::string format_ended_early(const CampaignSummary& summary);

using ProgressSink = std::function<void(const TrialProgress&)>;

/// The caller's callbacks and controls of a run. Each may be left empty.
struct CampaignHooks {
  ProgressSink progress;
  DeviceLogSink device_log;  ///< warnings and errors of the drivers
  /// Checked between events; a signal handler may set it. True: the current trial is aborted, the
  /// probe retracted and the campaign ended. Everything recorded so far is kept.
  const std::atomic<bool>* stop = nullptr;
  /// Also checked between events; see RunOrders. Required for a recipe with operator steps:
  /// otherwise they could not be confirmed.
  RunOrders* orders = nullptr;
  /// Called on the run's thread before the first message to a device. A run that ends without this
  /// call has left the rig as it was. If it fails, no message is sent and the run ends with its
  /// error.
  std::function<Status()> rig_acquired;
  /// Called at each change of the engine's step, on the run's thread.
  std::function<void(const RunStatusUpdate&)> moment;
  /// Called for every live vote, on the run's thread.
  std::function<void(const LiveVoteUpdate&)> vote = {};
  /// Called on the run's thread when the recipe has been checked; nothing has moved.
  std::function<void(const recipes::Plan&)> planned = {};
  /// Receives the bench's readings for viewers; null: none.
  LiveFrameSampler* frame_sampler = nullptr;
  /// Simulated bench only. Applied only with `orders`, which end a wait.
  const BenchPace* pace = nullptr;
  /// State in which the run leaves a simulated bench. Null: not stored.
  SimulatedPlace* place = nullptr;
  /// Called when the run is over, with the trials that the error check of a simulated bench kept.
  std::function<void(const sim::Rig& rig, const std::vector<ErrorCheck::StoredTrial>& trials)>
      kept_trials = {};
};

/// The recipe's text, not resolved: from the request or from its file. Errors: read_text_file()'s.
Result<std::string> load_recipe_text(const CampaignRequest& request);

/// Journal kind of a campaign on one fabric of its recipe: {"fabric": NAME}.
inline constexpr const char* part_kind = "part";

/// Plan and rig of a request that passed all checks. The error lists all problems.
struct CheckedRequest {
  recipes::Plan plan;
  std::string recipe_text;  ///< resolved
  std::string rig_text;
  std::vector<recipes::Diagnostic> warnings;
  LiveModels models = {};
  std::optional<std::string> only_fabric = {};  ///< as requested
};
Result<CheckedRequest> check_request(const CampaignRequest& request);
/// check_request() for a waiting client. Reads only the heads of models and returns no `models`:
/// the run finds other problems of a model before it acquires the rig. Also assembles the bench dry
/// (daemon/campaign/bench_check.hpp), except drivers of plugins.
Result<CheckedRequest> check_quickly(const CampaignRequest& request);

/// A checked request with the rig file as it will be run and recorded: its fidelity is chosen.
struct SettledRequest {
  CheckedRequest checked;
  RigFile rig;
  SimulationNote simulation;
};
Result<SettledRequest> settled_request(const CampaignRequest& request);

/// choose_simulation() for a request. A resumed campaign keeps its recorded setting. Errors: those
/// of choose_simulation(); invalid_argument for an accuracy without the error check.
Result<ChosenSimulation> choose_fidelity(const CampaignRequest& request, const recipes::Plan& plan,
                                         const RigFile& rig);

/// Upper bound of the bytes of the campaign's file and its export. All forecast time counts as
/// recorded, which leaves room for trials that take longer than planned.
std::uint64_t disk_forecast(const recipes::Plan& plan);

/// Runs on the rig file's bench: in virtual time if it is simulated, otherwise in real time.
/// Refuses an `out` that already holds a campaign, unless it is resumed
/// (daemon/campaign/resume.hpp). An incomplete campaign is a summary, not an error. A campaign
/// without a data set is also a summary: its file is kept. A bench that does not come up leaves no
/// file.
Result<CampaignSummary> run_campaign(const CampaignRequest& request, const CampaignHooks& hooks);

}  // namespace weft::daemon
