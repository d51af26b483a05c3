#include "daemon/analysis/tradeoff/sim/promise_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "sim/plant/bounds.hpp"
#include "sim/plant/random.hpp"

namespace weft::daemon {
namespace {

constexpr std::array margins{1.0, 1.1, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0};
constexpr std::size_t trials_of_run = 34, resamples = 1000, folds = 3;

using Largest = std::map<std::string, std::vector<double>>;  // by fabric, then by setting
/// For each setting, the margins that the runs need.
using Needed = std::vector<std::vector<double>>;

Largest largest_by_cloth(const std::vector<const TrialErrors*>& trials) {
  Largest out;
  for (const TrialErrors* trial : trials) {
    auto& largest = out[trial->fabric];
    largest.resize(trial->error_n.size());
    for (std::size_t i = 0; i < largest.size(); ++i)
      largest[i] = std::max(largest[i], trial->error_n[i]);
  }
  return out;
}

/// Nearest-rank quantile; `sorted` is not empty.
double quantile(const std::vector<double>& sorted, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(rank, 1, sorted.size()) - 1];
}

double share_of_scale(const TrialErrors& trial, std::size_t setting) {
  return trial.scale_n > 0 ? trial.error_n[setting] / trial.scale_n : 0;
}

double needed_margin(double error, double promised) {
  return promised > 0 ? error / promised : error > 0 ? HUGE_VAL : 0;
}

void add_run(std::span<const TrialErrors* const> run, const Largest& promised, Needed& needed) {
  for (std::size_t i = 0; i < needed.size(); ++i) {
    double error_n = 0, promise_n = 0;
    for (const TrialErrors* trial : run) {
      error_n = std::max(error_n, trial->error_n[i]);
      promise_n = std::max(promise_n, promised.at(trial->fabric)[i]);
    }
    needed[i].push_back(needed_margin(error_n, promise_n));
  }
}

double held_share(const std::vector<double>& needed, double margin) {
  if (needed.empty()) return 0;
  const auto held = std::ranges::count_if(needed, [&](double m) { return m <= margin; });
  return static_cast<double>(held) / static_cast<double>(needed.size());
}

/// The margin of a setting, which must hold for each kind of run.
sim::Margin least_margin(const std::vector<Needed>& kinds_of_run, std::size_t setting) {
  sim::Margin out;
  for (const double margin : margins) {
    out = {margin, 1};
    for (const Needed& needed : kinds_of_run)
      out.held_share = std::min(out.held_share, held_share(needed[setting], margin));
    if (out.held_share >= promised_share) break;
  }
  return out;
}

std::vector<sim::Margin> least_margins(std::size_t settings,
                                       const std::vector<Needed>& kinds_of_run) {
  std::vector<sim::Margin> out;
  for (std::size_t i = 0; i < settings; ++i) out.push_back(least_margin(kinds_of_run, i));
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
      {Level::dynamic, Integrator::adaptive, grid_step_s / 64},
      {Level::dynamic, Integrator::adaptive, grid_step_s / 128},
      {Level::dynamic, Integrator::midpoint, grid_step_s / 16},
      {Level::dynamic, Integrator::midpoint, grid_step_s / 32},
      {Level::dynamic, Integrator::midpoint, grid_step_s / 64},
      {Level::modal, Integrator::adaptive, grid_step_s / 16},
      {Level::modal, Integrator::adaptive, grid_step_s / 64}};
  return settings;
}

std::vector<sim::Margin> find_margins(std::size_t settings, std::span<const TrialErrors> trials,
                                      std::span<const std::size_t> scene_of, std::uint64_t seed) {
  Needed alone(settings), together(settings);
  sim::Random random(sim::mix(seed, "margin"));
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<const TrialErrors*> measured, held_back;
    for (std::size_t i = 0; i < trials.size(); ++i)
      (scene_of[i] % folds == fold ? held_back : measured).push_back(&trials[i]);
    const Largest promised = largest_by_cloth(measured);
    std::erase_if(held_back, [&](const auto* t) { return !promised.contains(t->fabric); });
    if (held_back.empty()) continue;
    for (const TrialErrors* trial : held_back) add_run({&trial, 1}, promised, alone);
    for (std::size_t i = 0; i < resamples / folds; ++i) {
      std::vector<const TrialErrors*> run(trials_of_run);
      const auto count = static_cast<double>(held_back.size());
      for (auto& trial : run) trial = held_back[static_cast<std::size_t>(random.uniform() * count)];
      add_run(run, promised, together);
    }
  }
  return least_margins(settings, {alone, together});
}

std::vector<sim::Margin> find_any_margins(std::size_t settings,
                                          std::span<const TrialErrors> trials) {
  Needed needed(settings);
  std::set<std::string> fabrics;
  for (const TrialErrors& trial : trials) fabrics.insert(trial.fabric);
  for (const std::string& fabric : fabrics) {
    std::vector<double> others(needed.size(), 0);
    for (const TrialErrors& trial : trials)
      for (std::size_t i = 0; i < others.size() && trial.fabric != fabric; ++i)
        others[i] = std::max(others[i], share_of_scale(trial, i));
    for (const TrialErrors& trial : trials)
      for (std::size_t i = 0; i < others.size() && trial.fabric == fabric; ++i)
        needed[i].push_back(needed_margin(share_of_scale(trial, i), others[i]));
  }
  return least_margins(settings, {needed});
}

Status check_margins(const sim::FidelityTable& table) {
  for (std::size_t i = 0; i < table.settings.size(); ++i) {
    const sim::MeasuredSetting& row = table.settings[i];
    const bool rows = row.margin.held_share < table.conditions.share;
    const sim::Margin& worse = rows ? row.margin : row.any_margin;
    if (worse.held_share >= table.conditions.share) continue;
    return fail({.code = Errc::unsupported,
                 .where = "/settings/" + std::to_string(i) + (rows ? "" : "/any") + "/held_share",
                 .what = std::string("no margin up to ") + sim::printed("%g", margins.back()) +
                         " covers enough of the held-out runs" +
                         (rows ? "" : " of fabrics without a row") + ", at " +
                         to_string(row.setting),
                 .expected = sim::printed("%g %% of the runs", 100 * table.conditions.share),
                 .got = sim::printed("%.3g %%", 100 * worse.held_share),
                 .hint = "Measure more recipes and seeds (--table-recipes, --table-seeds)"});
  }
  return {};
}

sim::FidelityTable summarize_errors(const std::vector<sim::FidelitySetting>& settings,
                                    const std::vector<TrialErrors>& trials,
                                    const std::vector<std::size_t>& scene_of,
                                    std::uint64_t space_seed) {
  sim::FidelityTable out;
  out.conditions.share = promised_share;
  out.conditions.space_seed = space_seed;
  const auto of_cloths = find_margins(settings.size(), trials, scene_of, space_seed);
  const auto of_any = find_any_margins(settings.size(), trials);
  write_ranges(out.conditions);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    sim::MeasuredSetting row{.setting = settings[i],
                             .cloths = cloth_errors(trials, i),
                             .margin = of_cloths[i],
                             .any_margin = of_any[i]};
    std::vector<double> shares;
    for (const TrialErrors& trial : trials)
      if (trial.scale_n > 0) shares.push_back(share_of_scale(trial, i));
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
