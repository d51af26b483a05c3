#include "daemon/analysis/tradeoff/sim/promise_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "sim/plant/random.hpp"

namespace weft::daemon {
namespace {

constexpr std::array margins{1.0, 1.1, 1.25, 1.5, 2.0};
constexpr std::size_t trials_of_run = 34, resamples = 1000, held_back_every = 3;

using Largest = std::map<std::string, std::vector<double>>;  // of each cloth, by setting

Largest largest_by_cloth(std::span<const TrialErrors> trials) {
  Largest out;
  for (const TrialErrors& trial : trials) {
    auto& largest = out[trial.fabric];
    largest.resize(trial.error_n.size());
    for (std::size_t i = 0; i < largest.size(); ++i)
      largest[i] = std::max(largest[i], trial.error_n[i]);
  }
  return out;
}

/// By the nearest rank; `sorted` is not empty.
double quantile(const std::vector<double>& sorted, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(rank, 1, sorted.size()) - 1];
}

/// For each setting the margin that one run of the given trials needs.
std::vector<double> needed_margins(const std::vector<const TrialErrors*>& run,
                                   const Largest& promised) {
  std::vector<double> out(run.front()->error_n.size(), 0);
  for (std::size_t i = 0; i < out.size(); ++i) {
    double error_n = 0, promise_n = 0;
    for (const TrialErrors* trial : run) {
      error_n = std::max(error_n, trial->error_n[i]);
      promise_n = std::max(promise_n, promised.at(trial->fabric)[i]);
    }
    out[i] = promise_n > 0 ? error_n / promise_n : 0;
  }
  return out;
}

std::vector<sim::ClothError> cloth_errors(const std::vector<TrialErrors>& trials,
                                          std::size_t setting) {
  std::map<std::string, std::vector<double>> by_cloth;
  for (const TrialErrors& trial : trials) by_cloth[trial.fabric].push_back(trial.error_n[setting]);
  std::vector<sim::ClothError> out;
  for (auto& [fabric, errors_n] : by_cloth) {
    std::ranges::sort(errors_n);
    out.push_back({fabric, errors_n.size(), quantile(errors_n, 0.5),
                   quantile(errors_n, promised_share), errors_n.back()});
  }
  return out;
}

}  // namespace

const std::vector<sim::FidelitySetting>& promise_settings() {
  using sim::Integrator, sim::Level, sim::grid_step_s;
  static const std::vector<sim::FidelitySetting> settings{
      {Level::quasistatic, Integrator::midpoint, grid_step_s},
      {Level::quasistatic, Integrator::midpoint, 9 * grid_step_s},
      {Level::dynamic, Integrator::tr_bdf2, grid_step_s},
      {Level::dynamic, Integrator::tr_bdf2, grid_step_s / 4},
      {Level::dynamic, Integrator::adaptive, grid_step_s / 2},
      {Level::dynamic, Integrator::adaptive, grid_step_s / 4},
      {Level::dynamic, Integrator::adaptive, grid_step_s / 8},
      {Level::dynamic, Integrator::adaptive, grid_step_s / 16},
      {Level::dynamic, Integrator::adaptive, grid_step_s / 32},
      {Level::dynamic, Integrator::midpoint, grid_step_s / 16},
      {Level::dynamic, Integrator::midpoint, grid_step_s / 32},
      {Level::dynamic, Integrator::midpoint, grid_step_s / 64}};
  return settings;
}

double find_margin(std::span<const TrialErrors> measured, std::span<const TrialErrors> held_back,
                   std::uint64_t seed) {
  const Largest promised = largest_by_cloth(measured);
  std::vector<const TrialErrors*> pool;
  for (const TrialErrors& trial : held_back)
    if (promised.contains(trial.fabric)) pool.push_back(&trial);
  if (pool.empty()) return margins.front();
  sim::Random random(sim::mix(seed, "margin"));
  std::vector<std::vector<double>> needed(pool.front()->error_n.size());
  for (std::size_t i = 0; i < resamples; ++i) {
    std::vector<const TrialErrors*> run(trials_of_run);
    for (auto& trial : run)
      trial = pool[static_cast<std::size_t>(random.uniform() * static_cast<double>(pool.size()))];
    const auto margin = needed_margins(run, promised);
    for (std::size_t k = 0; k < margin.size(); ++k) needed[k].push_back(margin[k]);
  }
  double most = 0;
  for (auto& of_setting : needed) {
    std::ranges::sort(of_setting);
    most = std::max(most, quantile(of_setting, promised_share));
  }
  const auto found = std::ranges::find_if(margins, [most](double m) { return m >= most; });
  return found == margins.end() ? margins.back() : *found;
}

sim::FidelityTable summarize_errors(const std::vector<sim::FidelitySetting>& settings,
                                    const std::vector<TrialErrors>& trials,
                                    const std::vector<std::size_t>& scene_of,
                                    std::uint64_t space_seed) {
  std::vector<TrialErrors> measured, held_back;
  for (std::size_t i = 0; i < trials.size(); ++i)
    (scene_of[i] % held_back_every == held_back_every - 1 ? held_back : measured)
        .push_back(trials[i]);
  sim::FidelityTable out;
  out.conditions.share = promised_share;
  out.conditions.space_seed = space_seed;
  out.conditions.margin = find_margin(measured, held_back, space_seed);
  write_ranges(out.conditions);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    sim::MeasuredSetting row{.setting = settings[i], .cloths = cloth_errors(trials, i)};
    std::vector<double> shares;
    for (const TrialErrors& trial : trials)
      if (trial.scale_n > 0) shares.push_back(trial.error_n[i] / trial.scale_n);
    std::ranges::sort(shares);
    if (!shares.empty()) {
      row.any_q99 = quantile(shares, promised_share);
      row.any_max = shares.back();
    }
    out.settings.push_back(std::move(row));
  }
  return out;
}

}  // namespace weft::daemon
