#include "daemon/storage/imprints/recorded_imprints.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "recipes/engine/plan.hpp"

namespace weft::daemon {
namespace {

using classifier::imprint::Image;
using classifier::imprint::Imprint;
using classifier::imprint::TaxelGrid;
using nlohmann::json;

/// A whole number as a device reports it; nothing for any other text.
std::optional<std::size_t> number_of(const json& reported, const char* key) {
  constexpr std::size_t longest = 5;
  const auto found = reported.find(key);
  if (found == reported.end() || !found->is_string()) return std::nullopt;
  const std::string text = found->get<std::string>();
  const bool digits = std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
  if (text.empty() || text.size() > longest || !digits) return std::nullopt;
  return std::stoul(text);
}

std::optional<TaxelGrid> find_grid(const DeviceInfo& device, std::size_t taxels) {
  const json identity = json::parse(device.identity_json, nullptr, false);
  if (!identity.is_object()) return std::nullopt;
  const json reported = identity.value("reported", json::object());
  const auto rows = number_of(reported, "rows"), cols = number_of(reported, "cols");
  if (!rows || !cols || *rows * *cols != taxels || taxels == 0) return std::nullopt;
  constexpr double micrometre = 1e-6;
  return TaxelGrid{*rows, *cols,
                   static_cast<double>(number_of(reported, "spacing_um").value_or(0)) * micrometre,
                   number_of(reported, "bits").value_or(0)};
}

/// Of each object; empty where the recipe has no classes, or there is none.
Result<std::map<std::string, std::string>> classes_on_record(const DatasetInfo& info) {
  std::map<std::string, std::string> out;
  if (info.recipe_json.empty() || info.rig_json.empty()) return out;
  const auto limits = recipes::parse_rig_limits(info.rig_json);
  if (!limits) return pass(limits.error());
  const recipes::CheckReport report = recipes::check_recipe(info.recipe_json, *limits);
  if (!report.plan)
    return fail({.code = Errc::corrupt,
                 .what = "the recipe on record cannot be read: " +
                         recipes::to_string(report.problems.front())});
  for (std::size_t i = 0; i < report.plan->class_of.size(); ++i)
    out[report.plan->fabrics[i]] = report.plan->class_of[i];
  return out;
}

Result<Image> make_image(const classifier::Trial& trial, const TaxelGrid& grid) {
  const auto last = std::find(trial.phase.rbegin(), trial.phase.rend(), Phase::press);
  if (last == trial.phase.rend())
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "no scan in phase P",
                 .expected = "at least one",
                 .got = "none",
                 .hint = "Hold phase P for longer than the array's period"});
  const auto at = static_cast<std::size_t>(trial.phase.rend() - last - 1);
  Image image(grid.rows, grid.cols);
  const auto first = trial.counts.begin() + static_cast<std::ptrdiff_t>(at * trial.taxels);
  std::copy_n(first, trial.taxels, image.data().begin());
  return image;
}

}  // namespace

std::optional<TaxelGrid> grid_of_scans(const Dataset& dataset) {
  if (dataset.trials.empty()) return std::nullopt;
  for (const DeviceInfo& device : dataset.info.devices)
    if (const auto grid = find_grid(device, dataset.trials.front().taxels)) return grid;
  return std::nullopt;
}

bool holds_scans(const Dataset& dataset) {
  return grid_of_scans(dataset).has_value();
}

Result<std::vector<Imprint>> imprints_of_scans(const Dataset& dataset) {
  const auto grid = grid_of_scans(dataset);
  if (!grid)
    return fail({.code = Errc::invalid_argument,
                 .what = "the data set holds no scans of an array",
                 .expected = "a device that tells of rows and columns",
                 .got = dataset.info.source});
  const auto classes = classes_on_record(dataset.info);
  if (!classes) return pass(classes.error());
  std::vector<Imprint> out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    if (dataset.records[i].outcome != TrialOutcome::complete) continue;
    const classifier::Trial& trial = dataset.trials[i];
    auto image = make_image(trial, *grid);
    if (!image) return pass(image.error());
    const auto its_class = classes->find(trial.label);
    out.push_back({std::move(*image), trial.file,
                   its_class == classes->end() ? trial.label : its_class->second, trial.label});
  }
  return out;
}

}  // namespace weft::daemon
