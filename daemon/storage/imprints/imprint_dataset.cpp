#include "daemon/storage/imprints/imprint_dataset.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>

#include "daemon/storage/dataset/trial_csv.hpp"
#include "daemon/storage/imprints/recorded_imprints.hpp"

namespace weft::daemon {

using classifier::imprint::Image;
using classifier::imprint::Imprint;
using classifier::imprint::TaxelGrid;

namespace {

/// What the scene `imprint` wrote down of its array, see imprint_scene.hpp.
void read_scene(const std::string& text, TaxelGrid& grid) {
  const auto scene = nlohmann::json::parse(text, nullptr, false);
  if (!scene.is_object() || scene.value("scene", nlohmann::json()) != "imprint") return;
  const auto array = scene.value("array", nlohmann::json::object());
  if (array.is_object() && array.contains("spacing_m") && array["spacing_m"].is_number())
    grid.pitch_m = array["spacing_m"];
  if (scene.contains("bits") && scene["bits"].is_number_unsigned()) grid.count_bits = scene["bits"];
}

}  // namespace

namespace {

std::string format_size(std::size_t rows, std::size_t cols) {
  return std::to_string(rows) + " x " + std::to_string(cols) + " taxels";
}

// Imprints of a set are of one array.
Status check_size(const classifier::Trial& first, std::size_t rows, std::size_t cols,
                  const std::string& file) {
  if (first.samples() == rows && first.taxels == cols) return {};
  return fail({.code = Errc::invalid_argument,
               .where = file,
               .what = "imprints of different sizes",
               .expected = format_size(first.samples(), first.taxels) + " as in " + first.file,
               .got = format_size(rows, cols),
               .hint = "Make a data set of the imprints of each array"});
}

}  // namespace

bool holds_imprints(const Dataset& dataset) {
  if (holds_scans(dataset)) return true;
  return !dataset.records.empty() && std::ranges::all_of(dataset.records, [](const auto& record) {
    return record.spec.exploration == imprint_exploration;
  });
}

Status append_imprint(Dataset& dataset, const Image& image, std::string file, std::string label,
                      std::string group) {
  if (!dataset.trials.empty())
    if (auto ok = check_size(dataset.trials.front(), image.rows(), image.cols(), file); !ok)
      return ok;
  classifier::Trial trial;
  trial.file = std::move(file);
  trial.label = std::move(label);
  trial.group = std::move(group);
  trial.taxels = image.cols();
  trial.counts.assign(image.data().begin(), image.data().end());
  trial.phase.assign(image.rows(), Phase::motion);
  TrialRecord record;
  record.spec.exploration = imprint_exploration;
  record.t_ns.assign(image.rows(), 0);
  return append(dataset, std::move(trial), std::move(record));
}

Result<std::vector<Imprint>> extract_imprints(const Dataset& dataset) {
  if (!holds_imprints(dataset))
    return fail({.code = Errc::invalid_argument,
                 .what = "the data set does not hold imprints alone",
                 .expected = "trials of exploration imprint",
                 .got = dataset.info.source,
                 .hint = "weft dataset import --help"});
  if (holds_scans(dataset)) return imprints_of_scans(dataset);
  // Objects may be numbered within their class: then a group's name alone is no object's.
  std::map<std::string, std::string> label_of;
  bool within_class = false;
  for (const classifier::Trial& trial : dataset.trials)
    within_class |= label_of.emplace(trial.group, trial.label).first->second != trial.label;
  const auto object_of = [&](const classifier::Trial& trial) {
    if (trial.group.empty()) return trial.file;
    return within_class ? trial.label + "/" + trial.group : trial.group;
  };
  std::vector<Imprint> out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const classifier::Trial& trial = dataset.trials[i];
    if (dataset.records[i].outcome != TrialOutcome::complete) continue;
    if (auto ok = check_size(dataset.trials.front(), trial.samples(), trial.taxels, trial.file);
        !ok)
      return pass(ok.error());
    Imprint one{Image(trial.samples(), trial.taxels), trial.file, trial.label, object_of(trial)};
    std::ranges::copy(trial.counts, one.image.data().begin());
    out.push_back(std::move(one));
  }
  return out;
}

Result<TaxelGrid> find_grid(const Dataset& dataset, std::span<const Imprint> imprints) {
  if (imprints.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = dataset.info.source,
                 .what = "no imprint",
                 .expected = "one or more"});
  TaxelGrid out = grid_of_scans(dataset).value_or(
      TaxelGrid{imprints.front().image.rows(), imprints.front().image.cols()});
  read_scene(dataset.info.rig_json, out);
  for (const Imprint& imprint : imprints)
    if (auto ok = check_imprint(out, imprint); !ok) return pass(ok.error());
  return out;
}

}  // namespace weft::daemon
