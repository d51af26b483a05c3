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
  std::filesystem::path recipe;  ///< and its folder that of its models
  std::filesystem::path rig;
  std::filesystem::path out;  ///< folder for campaign.sqlite and dataset.h5; made when missing
  std::optional<std::uint64_t> seed;  ///< in place of the recipe's
  FidelityRequest fidelity = {};
  bool error_check = true;      ///< simulate some trials again, more finely, when all are done
  PluginSettings plugins = {};  ///< beside those that the rig file names
  /// Goes on with the campaign that `out` holds; begins it where nothing is on record yet.
  bool resume = false;
  /// What `weft align --json` said, where the plate is to be held level; empty: the rig file as it
  /// stands. A campaign that is resumed takes the same file, whenever it was measured.
  std::filesystem::path level = {};
  std::chrono::seconds oldest_level = std::chrono::hours(24);  ///< zero: any age
  std::optional<std::string> recipe_text = {};  ///< in place of what its file says by now
  std::string parameters_json = {};  ///< of the recipe, {NAME: value}; empty: their defaults
  /// With `resume`: one that came to its end is told as its file has it, where otherwise it is
  /// refused that nothing is left. A daemon may die between a campaign's end and its own note of
  /// it.
  bool accept_whole = false;
};

/// Where the wall time of the run went, estimated by sampling [s].
struct WallTimeBreakdown {
  double plant_and_emulators_s = 0;
  double drivers_and_control_s = 0;
  double recorder_s = 0;
  double export_s = 0;
  double error_check_s = 0;  ///< measured, and no part of the run's wall time
};

/// One line of progress, after each trial.
struct TrialProgress {
  std::size_t done = 0;
  std::size_t planned = 0;
  std::string fabric;
  std::string exploration;
  std::uint32_t repetition = 0;
  recipes::Outcome outcome = recipes::Outcome::complete;
  std::optional<Error> error;               ///< why it is not complete
  std::size_t attempts_rejected = 0;        ///< of the campaign so far
  std::optional<double> force_rms_error_n;  ///< phase M; none without a force sample in it
  std::uint64_t frames_lost = 0;            ///< of the campaign so far [count]
  std::optional<double> recorder_lag_s;  ///< longest commit since the line before; none without one
  double virtual_s = 0;                  ///< of the campaign so far
  double wall_s = 0;
  std::optional<double> wall_left_s;  ///< RunForecast::left_s()
};

struct CampaignSummary {
  std::string name;
  BenchKind bench = BenchKind::unknown;
  std::string level;  ///< fidelity of the plant, empty on a real bench
  SimulationNote simulation;
  recipes::Outcome outcome = recipes::Outcome::complete;
  recipes::Cleanup cleanup = recipes::Cleanup::done;
  recipes::RigFact rig = recipes::RigFact::safe;
  std::optional<Error> error;  ///< the first thing that went wrong
  /// What kept file, data set or certificate from being concluded after the bench had come to its
  /// end: a fact of its own, that changes nothing of the three above.
  std::optional<Error> dataset_error;
  std::size_t trials_planned = 0;
  std::size_t trials_complete = 0;  ///< those whose slide ended early among them
  std::size_t trials_ended_early = 0;
  std::size_t attempts_rejected = 0;  ///< bad ones, kept beside the good ones that followed
  double forecast_s = 0;              ///< of the plan
  double virtual_s = 0;               ///< time on the bench's clock
  double bring_up_s = 0;  ///< the part of it that opening and homing took; not in the forecast
  double wall_s = 0;      ///< bringing up, running and recording; export apart
  ForceTally force;       ///< phase M of all complete trials
  std::string dataset_sha256;
  std::filesystem::path campaign_file;
  std::filesystem::path dataset_file;
  WallTimeBreakdown time;
  std::uint64_t events = 0;      ///< callbacks of the virtual loop
  bool has_handover = false;     ///< it is evaluated once it is complete
  bool states_handover = false;  ///< for its recipe asks for that
};

/// ", 12 of them with slides that ended early, which are in no data set", or nothing.
std::string format_ended_early(const CampaignSummary& summary);

using ProgressSink = std::function<void(const TrialProgress&)>;

/// What a caller wants to hear of a run, and how it ends one. Each may be left empty.
struct CampaignHooks {
  ProgressSink progress;
  DeviceLogSink device_log;  ///< warnings and errors of the drivers
  /// Looked at between events, and may be set by a signal handler. True: the trial under way is
  /// aborted, the probe retracted and the campaign ended, with everything recorded so far kept.
  const std::atomic<bool>* stop = nullptr;
  /// Looked at between events too; see RunOrders. A recipe with operator steps needs it: nobody
  /// could confirm them.
  RunOrders* orders = nullptr;
  /// Before anything is said to a device, on the run's thread. A run that ends without it has left
  /// the rig as it was. Where it fails nothing is said, and the run ends with its error.
  std::function<Status()> rig_acquired;
  /// At each change of the engine's step, on the run's thread.
  std::function<void(const RunStatusUpdate&)> moment;
  /// Every live vote of a recipe that has one, likewise.
  std::function<void(const LiveVoteUpdate&)> vote = {};
  /// Once the recipe is checked, likewise; nothing has moved.
  std::function<void(const recipes::Plan&)> planned = {};
  /// Shown what the bench senses, where somebody looks.
  LiveFrameSampler* frame_sampler = nullptr;
  /// Of a simulated bench; kept only where there are `orders`, which end a wait.
  const BenchPace* pace = nullptr;
  /// Where the run leaves a simulated bench. Null: not kept.
  SimulatedPlace* place = nullptr;
  /// The trials that the error check of a simulated bench kept, once the run is over.
  std::function<void(const sim::Rig& rig, const std::vector<ErrorCheck::StoredTrial>& trials)>
      kept_trials = {};
};

/// The recipe's text, not resolved: the request's, or that of its file. Errors: read_text_file()'s.
Result<std::string> load_recipe_text(const CampaignRequest& request);

/// Plan and rig of a request, everything refused that can be refused. The error lists all problems.
struct CheckedRequest {
  recipes::Plan plan;
  std::string recipe_text;  ///< resolved
  std::string rig_text;
  std::vector<recipes::Diagnostic> warnings;
  LiveModels models = {};
};
Result<CheckedRequest> check_request(const CampaignRequest& request);
/// For who waits for an answer: check_request() with the models' heads alone, and no `models`; what
/// is wrong with the rest of a model is found by the run, before it takes the rig. The bench is put
/// together dry as well (daemon/campaign/bench_check.hpp), short of drivers that are plugins'.
Result<CheckedRequest> check_quickly(const CampaignRequest& request);

/// check_request(), with the rig file as it will be run and recorded: its fidelity chosen.
struct SettledRequest {
  CheckedRequest checked;
  RigFile rig;
  SimulationNote simulation;
};
Result<SettledRequest> settled_request(const CampaignRequest& request);

/// choose_simulation() for a request: a resumed campaign keeps the setting of its record. Errors:
/// invalid_argument, for an accuracy that is not checked.
Result<ChosenSimulation> choose_fidelity(const CampaignRequest& request, const recipes::Plan& plan,
                                         const RigFile& rig);

/// Bytes that the campaign's file and its export need at most. All of the forecast time counts as
/// recorded, which leaves room for trials that take longer than planned.
std::uint64_t disk_forecast(const recipes::Plan& plan);

/// Runs on the rig file's bench: in virtual time where it is simulated, in real time else. Refuses
/// an `out` that holds a campaign already, unless it is to be resumed (daemon/campaign/resume.hpp).
/// An incomplete campaign is a summary, not an error, and so is one without a data set: its file is
/// kept. A bench that does not come up leaves no file.
Result<CampaignSummary> run_campaign(const CampaignRequest& request, const CampaignHooks& hooks);

}  // namespace weft::daemon
