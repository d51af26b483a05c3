#include "daemon/run/campaign.hpp"

#include <nlohmann/json.hpp>

#include "daemon/dataset/hdf5_file.hpp"
#include "daemon/loop/wall_clock.hpp"
#include "daemon/run/simulated_bench.hpp"
#include "daemon/run/supervisor.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

constexpr double stage_rate_hz = 20;  // see scan_cycle.cpp

double seconds_since(std::chrono::nanoseconds begin) {
  return std::chrono::duration<double>(steady_wall_now() - begin).count();
}

std::string all_problems(const std::vector<recipes::Diagnostic>& problems) {
  std::string text =
      std::to_string(problems.size()) + (problems.size() == 1 ? " problem:" : " problems:");
  for (const recipes::Diagnostic& problem : problems) text += "\n  " + recipes::to_string(problem);
  return text;
}

CampaignHeader header_of(const CheckedRequest& checked, const RigFile& rig) {
  const recipes::Plan& plan = checked.plan;
  CampaignHeader header;
  header.info.kind = rig.bench;
  header.info.name = plan.name;
  header.info.source = "campaign";
  header.info.recipe_json = checked.recipe_text;
  header.info.rig_json = checked.rig_text;
  header.info.seed = plan.seed;
  header.info.software_version = WEFT_VERSION;
  header.info.taxel_rate_hz = plan.limits.taxel_rate_hz;
  header.info.wrench_rate_hz = plan.limits.wrench_rate_hz;
  header.info.stage_rate_hz = stage_rate_hz;
  for (const StageAxis axis : recipes::all_axes)
    header.info.axes.push_back({std::string(recipes::to_string(axis)), !recipes::is_linear(axis)});
  header.taxels = plan.limits.taxels;
  header.trials_planned = static_cast<std::uint32_t>(plan.trials.size());
  header.created_utc_ns = utc_now().count();
  return header;
}

// The parts of a run in progress, and what is told about it.
class Run {
 public:
  Run(const CheckedRequest& checked, SimulatedBench& bench, Recorder& recorder,
      const ProgressSink& progress)
      : plan_(&checked.plan),
        bench_(&bench),
        recording_(recorder, checked.plan),
        progress_(&progress) {}

  Status bring_up() {
    std::optional<Status> up;
    bench_->bench->bring_up([&up](Status outcome) { up = std::move(outcome); });
    bench_->loop.run_until([&up] { return up.has_value(); });
    brought_up_ = bench_->loop.now();
    return up ? *up : Status(fail(Errc::timeout, "the bench fell silent", "bench"));
  }

  CampaignSummary execute() {
    SupervisorHooks hooks;
    hooks.mount = [this](std::string_view fabric, std::uint64_t patch, TimePoint now) {
      return bench_->rig->mount(fabric, patch, now);
    };
    hooks.trial_done = [this](const recipes::TrialDone& done, const ForceTally& force) {
      tell(done, force);
    };
    Supervisor supervisor(*plan_, bench_->host_time, *bench_->bench, recording_, std::move(hooks));
    supervisor.start();
    bench_->loop.run_until([&] { return supervisor.result().has_value(); });
    return summary(supervisor.result());
  }

 private:
  void tell(const recipes::TrialDone& done, const ForceTally& force) {
    const recipes::TrialSpec& spec = plan_->trials[done.trial];
    complete_ += done.outcome == recipes::Outcome::complete ? 1 : 0;
    if (done.error)
      recording_.journal(bench_->loop.now(), "trial_error",
                         json{{"trial", done.trial}, {"error", to_string(*done.error)}}.dump());
    if (!*progress_) return;
    TrialProgress line;
    line.done = done.trial + 1;
    line.planned = plan_->trials.size();
    line.fabric = plan_->fabrics[spec.fabric];
    line.exploration = plan_->explorations[spec.exploration].name;
    line.repetition = spec.repetition;
    line.outcome = done.outcome;
    line.force_rms_error_n = force.rms_n();
    line.virtual_s = to_seconds(bench_->loop.now());
    line.wall_s = seconds_since(began_);
    line.wall_left_s = line.wall_s * static_cast<double>(line.planned - line.done) /
                       static_cast<double>(line.done);
    (*progress_)(line);
  }

  CampaignSummary summary(const std::optional<recipes::CampaignDone>& done) const {
    CampaignSummary s;
    s.name = plan_->name;
    s.outcome = done ? done->outcome : recipes::Outcome::failed;
    s.cleanup = done ? done->cleanup : recipes::Cleanup::failed;
    s.rig = done ? done->rig : recipes::RigFact::unknown;
    s.error = done ? done->error : std::nullopt;
    s.trials_planned = plan_->trials.size();
    s.trials_complete = complete_;
    s.forecast_s = plan_->forecast.duration_s;
    s.virtual_s = to_seconds(bench_->loop.now());
    s.bring_up_s = to_seconds(brought_up_);
    s.force = recording_.campaign_force();
    s.time.plant_and_emulators_s = bench_->rig_time.seconds();
    s.time.recorder_s = recording_.seconds();
    s.time.drivers_and_control_s =
        std::max(0.0, bench_->host_time.seconds() - recording_.seconds());
    s.events = bench_->loop.events();
    return s;
  }

  const recipes::Plan* plan_;
  SimulatedBench* bench_;
  TrialRecording recording_;
  const ProgressSink* progress_;
  std::size_t complete_ = 0;
  TimePoint brought_up_;
  std::chrono::nanoseconds began_ = steady_wall_now();
};

Status record_devices(Recorder& recorder, const RigFile& rig) {
  for (const DeviceEntry& device : rig.devices)
    if (Status ok = recorder.device({device.name, device.driver, device.config_json}); !ok)
      return ok;
  return {};
}

Result<std::string> export_dataset(const std::filesystem::path& campaign,
                                   const std::filesystem::path& dataset) {
  const Result<Dataset> loaded = load_campaign(campaign);
  if (!loaded) return pass(loaded.error());
  return write_hdf5(*loaded, dataset);
}

Status prepare_folder(const CampaignRequest& request, std::uint64_t bytes) {
  std::error_code error;
  std::filesystem::create_directories(request.out, error);
  if (error)
    return fail(Errc::io, "cannot make the folder", request.out.string(), {}, error.message());
  return check_space(request.out, bytes);
}

}  // namespace

Result<CheckedRequest> check_request(const CampaignRequest& request) {
  Result<std::string> rig_text = read_text_file(request.rig);
  if (!rig_text) return pass(rig_text.error());
  Result<recipes::RigLimits> limits = recipes::parse_rig_limits(*rig_text);
  if (!limits) return pass(limits.error(), request.rig.string());
  Result<std::string> recipe = read_text_file(request.recipe, recipes::max_recipe_bytes);
  if (!recipe) return pass(recipe.error());
  recipes::CheckReport report = recipes::check_recipe(*recipe, *limits, request.seed);
  if (!report.plan)
    return fail(Errc::invalid_argument, all_problems(report.problems), request.recipe.string());
  return CheckedRequest{std::move(*report.plan), std::move(*recipe), *rig_text,
                        std::move(report.warnings)};
}

Result<CampaignSummary> run_campaign(const CampaignRequest& request, const ProgressSink& progress) {
  Result<CheckedRequest> checked = check_request(request);
  if (!checked) return pass(checked.error());
  Result<RigFile> rig = parse_rig_file(checked->rig_text);
  if (!rig) return pass(rig.error(), request.rig.string());
  Result<std::string> fabrics = read_fabrics(*rig, request.rig);
  if (!fabrics) return pass(fabrics.error());
  const auto began = steady_wall_now();
  Result<std::unique_ptr<SimulatedBench>> bench =
      SimulatedBench::create(*rig, *fabrics, checked->plan.seed);
  if (!bench) return pass(bench.error(), request.rig.string());
  if (Status ok = prepare_folder(request, checked->plan.forecast.bytes); !ok)
    return pass(ok.error());
  const std::filesystem::path campaign_file = request.out / "campaign.sqlite";
  Result<Recorder> recorder = Recorder::create(campaign_file, header_of(*checked, *rig));
  if (!recorder) return pass(recorder.error());
  if (Status ok = record_devices(*recorder, *rig); !ok) return pass(ok.error());

  Run run(*checked, **bench, *recorder, progress);
  if (Status up = run.bring_up(); !up) return pass(up.error());
  CampaignSummary summary = run.execute();
  if (Status ok = recorder->finish(); !ok) return pass(ok.error());
  summary.wall_s = seconds_since(began);
  summary.bench = rig->bench;
  summary.level = rig->plant_level;
  summary.campaign_file = campaign_file;
  if (summary.trials_complete == 0) return summary;
  const auto export_began = steady_wall_now();
  summary.dataset_file = request.out / "dataset.h5";
  Result<std::string> digest = export_dataset(campaign_file, summary.dataset_file);
  if (!digest) return pass(digest.error());
  summary.dataset_sha256 = *digest;
  summary.time.export_s = seconds_since(export_began);
  return summary;
}

}  // namespace weft::daemon
