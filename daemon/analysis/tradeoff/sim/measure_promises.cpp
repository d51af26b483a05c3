#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/analysis/report/evaluate_campaign.hpp"
#include "daemon/analysis/tradeoff/sim/promise_table.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "recipes/engine/plan.hpp"
#include "sim/plant/fidelity/choose.hpp"
#include "sim/plant/fidelity/reference.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t fully_checked_trials = 10;  // number of full checks, for their cost
constexpr double largest_failed_share = 0.2;
constexpr std::size_t evaluated_fabrics = 17,
                      evaluated_repetitions = 6;  // for the cost of an evaluation

/// Removed with all its contents on destruction.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (fs::temp_directory_path() / "weft-promise-XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// Processor time of the measured trials [s].
struct CostTally {
  double bench_s = 0;             ///< duration of the runs in bench time
  double replayed_s = 0;          ///< bench time that was replayed
  std::vector<double> contact_s;  ///< per setting
  double pads_s = 0, emulators_s = 0, drivers_s = 0, recorder_s = 0, export_s = 0;
  double quick_check_s = 0, full_check_s = 0, fully_checked_s = 0;
  std::size_t trials = 0;
};

double motion_s(const sim::BenchMotion& motion) {
  return 1e-9 * static_cast<double>(sim::pad_timing::frame_ns) *
         (static_cast<double>(motion.poses.size()) / (sim::pad_timing::stages + 1));
}

class PromiseMeasurement {
 public:
  PromiseMeasurement(const PromiseTableOptions& options, const std::function<double()>& cpu_seconds)
      : options_(options), cpu_s_(cpu_seconds) {
    costs_.contact_s.resize(options.settings.size());
    sim::FidelitySetting finest = options.settings.front();
    for (const sim::FidelitySetting& setting : options.settings)
      if (setting.level >= sim::Level::dynamic &&
          (finest.level < sim::Level::dynamic || setting.step_s < finest.step_s))
        finest = setting;
    reference_ = sim::first_reference(finest);
  }

  Status measure(std::size_t index, const RecipeScene& scene, std::uint64_t seed) {
    const ScratchFolder folder;
    const auto request = request_in(folder.path(), scene, scene_recipe(scene, seed));
    if (!request) return pass(request.error());
    std::optional<TrialErrors> found;
    CampaignHooks hooks;
    hooks.kept_trials = [&](const sim::Rig& rig, const auto& kept) {
      if (!kept.empty()) found = replay_all(rig, kept.front());
    };
    const double began_s = cpu_s_(), wall_began_s = steady_wall_seconds();
    const auto summary = run_campaign(*request, hooks);
    // Times of a campaign's parts are wall times; this share converts them to processor time.
    const double cpu_share = (cpu_s_() - began_s) / (steady_wall_seconds() - wall_began_s);
    ++attempted_;
    if (!summary || !found) {  // a failed trial has no error to record
      if (first_failure_.empty()) first_failure_ = describe(scene, summary);
      return {};
    }
    found->fabric = scene.fabric;
    const auto scale_n = scale_of(scene);
    if (!scale_n) return pass(scale_n.error());
    found->scale_n = *scale_n;
    add_costs(*summary, cpu_share);
    trials_.push_back(std::move(*found));
    scene_of_.push_back(index);
    return {};
  }

  /// Cost of a campaign's report; a campaign of a single fabric is not evaluated.
  Status measure_evaluation(const std::vector<std::string>& fabrics) {
    if (fabrics.size() < 2) return {};
    const ScratchFolder folder;
    const RecipeScene scene{.fabric = fabrics.front()};
    nlohmann::json recipe = nlohmann::json::parse(scene_recipe(scene, 1));
    const auto end =
        fabrics.begin() + static_cast<std::ptrdiff_t>(std::min(fabrics.size(), evaluated_fabrics));
    recipe["fabrics"] = std::vector<std::string>(fabrics.begin(), end);
    recipe["repetitions"] = evaluated_repetitions;
    const auto request = request_in(folder.path(), scene, recipe.dump());
    if (!request) return pass(request.error());
    const auto summary = run_campaign(*request, {});
    if (!summary) return pass(summary.error());
    const auto dataset = read_hdf5(summary->dataset_file);
    if (!dataset) return pass(dataset.error());
    const double began_s = cpu_s_();
    const auto results = evaluate_campaign(*dataset, {.threads = 1}, {});
    if (!results) return pass(results.error(), "evaluation");
    evaluate_s_ = (cpu_s_() - began_s) / static_cast<double>(summary->trials_complete);
    return {};
  }

  Result<sim::FidelityTable> finish() const {
    const std::size_t failed = attempted_ - trials_.size();
    if (trials_.empty() ||
        static_cast<double>(failed) > largest_failed_share * static_cast<double>(attempted_))
      return fail({.code = Errc::unsupported,
                   .where = "recipe space",
                   .what = "too many trials of random recipes failed",
                   .expected = "at most a fifth",
                   .got = std::to_string(failed) + " of " + std::to_string(attempted_) +
                          ", first failure: " + first_failure_});
    if (Status ok = check_finite(); !ok) return pass(ok.error());
    sim::FidelityTable out =
        summarize_errors(options_.settings, trials_, scene_of_, options_.space_seed);
    out.rules = recipes::engine_rules;
    out.fabrics_sha256 = sha256_hex(options_.fabrics_json);
    out.conditions.scenes = options_.scenes;
    out.conditions.seeds = options_.seeds;
    out.conditions.trials = trials_.size();
    out.conditions.reference = to_string(reference_.setting());
    for (std::size_t i = 0; i < out.settings.size(); ++i)
      out.settings[i].contact_us_per_s = std::max(1e-3, per_s_us(costs_.contact_s[i]));
    out.host_cost = host_cost();
    return out;
  }

 private:
  /// JSON has no infinity, and no margin covers it.
  [[nodiscard]] Status check_finite() const {
    for (std::size_t i = 0; i < trials_.size(); ++i)
      for (std::size_t k = 0; k < options_.settings.size(); ++k)
        if (!std::isfinite(trials_[i].error_n[k]))
          return fail({.code = Errc::unsupported,
                       .where = "recipe " + std::to_string(scene_of_[i] + 1) + " of the space",
                       .what = "simulated force not finite",
                       .got = to_string(options_.settings[k]) + " on " + trials_[i].fabric});
    return {};
  }

  static std::string describe(const RecipeScene& scene, const Result<CampaignSummary>& summary) {
    const std::string why = !summary         ? to_string(summary.error())
                            : summary->error ? to_string(*summary->error)
                                             : "no trials kept";
    return scene_recipe(scene, 1) + ": " + why;
  }

  /// Fails without a folder, if a file cannot be written, or if the scene's rig is invalid.
  Result<CampaignRequest> request_in(const fs::path& folder, const RecipeScene& scene,
                                     const std::string& recipe) const {
    if (folder.empty())
      return fail({.code = Errc::io, .where = "/tmp", .what = "folder not created"});
    const auto rig = scene_rig(options_.rig_json, scene);
    if (!rig) return pass(rig.error());
    const auto fabrics = scene_fabrics(options_.fabrics_json, scene);
    if (!fabrics) return pass(fabrics.error());
    for (const auto& [name, text] :
         {std::pair{"recipe.json", recipe}, {"rig.json", *rig}, {"fabrics.json", *fabrics}})
      if (Status ok = write_text_file(folder / name, text); !ok) return pass(ok.error());
    return CampaignRequest{folder / "recipe.json", folder / "rig.json", folder / "out", {}};
  }

  TrialErrors replay_all(const sim::Rig& rig, const ErrorCheck::StoredTrial& kept) {
    const sim::PlantParams& params = rig.plant_params();
    const auto points = sim::wrench_points(kept.motion, kept.sampled.wrench);
    double began_s = cpu_s_();
    const sim::Replayed run = sim::replay(params, rig.seed(), kept.motion, points);
    const double with_pads_s = cpu_s_() - began_s;
    const std::vector<bool> counted =
        sim::counted_frames(kept.motion, run.normal_n.size(), kept.sampled.pads);
    const auto led = [&](const sim::FidelitySetting& setting, bool pads) {
      sim::PlantParams other = params;
      apply(setting, other);
      other.watched.pads = params.watched.pads && pads;
      return sim::replay_led(other, rig.seed(), kept.motion, run, points);
    };
    const sim::Replayed reference = led(reference_.setting(), false);
    TrialErrors out;
    std::vector<double> contact_of_s;
    for (std::size_t i = 0; i < options_.settings.size(); ++i) {
      const sim::FidelitySetting& setting = options_.settings[i];
      if (const auto same = same_force(i)) {
        out.error_n.push_back(out.error_n[*same]);
        contact_of_s.push_back(contact_of_s[*same]);
        costs_.contact_s[i] += contact_of_s.back();
        continue;
      }
      began_s = cpu_s_();
      sim::Replayed played = led(setting, false);
      const double contact_s = cpu_s_() - began_s;
      costs_.contact_s[i] += contact_s;
      contact_of_s.push_back(contact_s);
      if (setting == sim::setting_of(params)) {
        played = run;
        costs_.pads_s += std::max(0.0, with_pads_s - contact_s);
      } else if (setting.level == sim::Level::quasistatic) {
        played = led(setting, true);  // the taxels determine where a long step is balanced
      }
      out.error_n.push_back(sim::difference(played, reference, counted).force_max_n);
    }
    costs_.replayed_s += motion_s(kept.motion);
    check_fully(rig, kept);
    return out;
  }

  /// L3 has the same force as L2: returns an earlier setting that differs in the level only. The
  /// cost of L3's sensors is not measured, because the table's bench has none.
  [[nodiscard]] std::optional<std::size_t> same_force(std::size_t setting) const {
    sim::FidelitySetting wanted = options_.settings[setting];
    if (wanted.level != sim::Level::modal) return std::nullopt;
    wanted.level = sim::Level::dynamic;
    for (std::size_t i = 0; i < setting; ++i)
      if (options_.settings[i] == wanted) return i;
    return std::nullopt;
  }

  void check_fully(const sim::Rig& rig, const ErrorCheck::StoredTrial& kept) {
    constexpr double any_accuracy_n = 1000;  // large, so that references are not refined
    if (trials_.size() >= fully_checked_trials) return;
    const double began_s = cpu_s_();
    [[maybe_unused]] const auto error = rig.run_error(kept.motion, kept.sampled, any_accuracy_n);
    costs_.full_check_s += cpu_s_() - began_s;
    costs_.fully_checked_s += motion_s(kept.motion);
  }

  void add_costs(const CampaignSummary& summary, double cpu_share) {
    costs_.bench_s += summary.virtual_s;
    costs_.emulators_s += cpu_share * summary.time.plant_and_emulators_s;
    costs_.drivers_s += cpu_share * summary.time.drivers_and_control_s;
    costs_.recorder_s += cpu_share * summary.time.recorder_s;
    costs_.export_s += cpu_share * summary.time.export_s;
    costs_.quick_check_s += cpu_share * summary.time.error_check_s;
    ++costs_.trials;
  }

  [[nodiscard]] double per_s_us(double seconds) const { return 1e6 * seconds / costs_.replayed_s; }

  /// Subtracts the plant's own work from the common time of plant and emulators.
  [[nodiscard]] sim::HostCost host_cost() const {
    sim::HostCost out;
    const auto per_bench_s_us = [this](double seconds) { return 1e6 * seconds / costs_.bench_s; };
    out.pads_us_per_s = per_s_us(costs_.pads_s);
    const double plant_us = out.pads_us_per_s + per_s_us(costs_.contact_s.front());
    out.emulators_us_per_s = std::max(0.0, per_bench_s_us(costs_.emulators_s) - plant_us);
    out.drivers_us_per_s = per_bench_s_us(costs_.drivers_s);
    out.recorder_us_per_s = per_bench_s_us(costs_.recorder_s);
    out.export_us_per_trial = 1e6 * costs_.export_s / static_cast<double>(costs_.trials);
    out.evaluate_us_per_trial = 1e6 * evaluate_s_;
    out.quick_check_us_per_s = per_s_us(costs_.quick_check_s);
    out.full_check_us_per_s = 1e6 * costs_.full_check_s / costs_.fully_checked_s;
    out.probe_us = sim::measure_probe_us([this] { return 1e6 * cpu_s_(); });
    return out;
  }

  Result<double> scale_of(const RecipeScene& scene) const {
    const auto fabrics = scene_fabrics(options_.fabrics_json, scene);
    if (!fabrics) return pass(fabrics.error());
    const auto library = sim::parse_fabrics(*fabrics);
    if (!library) return pass(library.error());
    const auto law = sim::law_from_kes(library->find(scene.fabric)->kes);
    if (!law) return pass(law.error(), scene.fabric);
    sim::Mount mount;
    mount.mass_kg = mass_kg();
    return sim::impact_scale_n(*law, mount, scene.seat_speed_mps, scene.force_n,
                               sim::ContactGeometry{}.face_area_m2());
  }

  [[nodiscard]] double mass_kg() const {
    const auto limits = recipes::parse_rig_limits(options_.rig_json);
    return limits ? limits->probe_weight_n / standard_gravity_mps2 : sim::Mount{}.mass_kg;
  }

  const PromiseTableOptions& options_;
  const std::function<double()>& cpu_s_;
  sim::Reference reference_;
  CostTally costs_;
  double evaluate_s_ = 0;  ///< per trial
  std::vector<TrialErrors> trials_;
  std::vector<std::size_t> scene_of_;
  std::size_t attempted_ = 0;
  std::string first_failure_;
};

}  // namespace

Result<sim::FidelityTable> measure_promise_table(const PromiseTableOptions& options,
                                                 const std::function<double()>& cpu_seconds,
                                                 const PromiseProgress& progress) {
  const auto library = sim::parse_fabrics(options.fabrics_json);
  if (!library) return pass(library.error(), "cloth table");
  const auto limits = recipes::parse_rig_limits(options.rig_json);
  if (!limits) return pass(limits.error(), "rig file");
  const auto scenes = draw_recipe_scenes(library->names(), limits->probe_weight_n, options.scenes,
                                         options.space_seed);
  PromiseMeasurement measurement(options, cpu_seconds);
  if (Status ok = measurement.measure_evaluation(library->names()); !ok) return pass(ok.error());
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (progress && i % 20 == 0)
      progress("random recipes " + std::to_string(i + 1) + " to " +
               std::to_string(std::min(i + 20, scenes.size())) + " of " +
               std::to_string(scenes.size()));
    for (std::size_t seed = 1; seed <= options.seeds; ++seed)
      if (Status ok = measurement.measure(i, scenes[i], seed); !ok) return pass(ok.error());
  }
  return measurement.finish();
}

}  // namespace weft::daemon
