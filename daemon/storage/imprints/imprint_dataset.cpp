#include "daemon/storage/imprints/imprint_dataset.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/text/csv.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/dataset/trial_csv.hpp"
#include "daemon/storage/imprints/image_file.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {
namespace {

using classifier::imprint::Image;
using classifier::imprint::Imprint;
using classifier::imprint::TaxelGrid;
using nlohmann::json;

/// What the scene `imprint` wrote down of its array, see imprint_scene.hpp.
void read_scene(const std::string& text, TaxelGrid& grid) {
  const auto scene = nlohmann::json::parse(text, nullptr, false);
  if (!scene.is_object() || scene.value("scene", nlohmann::json()) != "imprint") return;
  const auto array = scene.value("array", nlohmann::json::object());
  if (array.is_object() && array.contains("spacing_m") && array["spacing_m"].is_number())
    grid.pitch_m = array["spacing_m"];
  if (scene.contains("bits") && scene["bits"].is_number_unsigned()) grid.count_bits = scene["bits"];
}

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

/// The first array of a device that has as many taxels as the trials; nothing of an empty set.
std::optional<TaxelGrid> grid_of_scans(const Dataset& dataset) {
  if (dataset.trials.empty()) return std::nullopt;
  for (const DeviceInfo& device : dataset.info.devices)
    if (const auto grid = find_grid(device, dataset.trials.front().taxels)) return grid;
  return std::nullopt;
}

/// One of each complete trial, in order: its object is the trial's label (the fabric), its label
/// the class that the recipe on record gives the object, or the object where the recipe has no
/// classes.
Result<std::vector<Imprint>> imprints_of_scans(const Dataset& dataset, const TaxelGrid& grid) {
  const auto classes = classes_on_record(dataset.info);
  if (!classes) return pass(classes.error());
  std::vector<Imprint> out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    if (dataset.records[i].outcome != TrialOutcome::complete) continue;
    const classifier::Trial& trial = dataset.trials[i];
    auto image = make_image(trial, grid);
    if (!image) return pass(image.error());
    const auto its_class = classes->find(trial.label);
    out.push_back({std::move(*image), trial.file,
                   its_class == classes->end() ? trial.label : its_class->second, trial.label});
  }
  return out;
}

Status import_table_line(NumberLines& lines, std::size_t rows, std::size_t cols, Dataset& dataset) {
  constexpr std::size_t words = 2;
  if (lines.fields().size() != words + rows * cols)
    return lines.complaint("wrong number of fields",
                           "label, group and " + std::to_string(rows * cols) + " values",
                           std::to_string(lines.fields().size()));
  const std::string label(lines.fields()[0]), group(lines.fields()[1]);
  if (label.empty()) return lines.complaint("the label is empty");
  if (!is_utf8(label) || !is_utf8(group))
    return lines.complaint("a name is not UTF-8", "UTF-8 text");
  Image image(rows, cols);
  for (std::size_t i = 0; i < rows * cols; ++i) {
    const auto value = lines.number(words + i);
    if (!value) return pass(value.error());
    image.data()[i] = *value;
  }
  auto done = append_imprint(dataset, image,
                             label + "/" + group + "#" + std::to_string(dataset.trials.size()),
                             label, group);
  if (!done) return pass(std::move(done).error(), lines.where());
  return {};
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
  if (const auto grid = grid_of_scans(dataset)) return imprints_of_scans(dataset, *grid);
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

bool holds_scans(const Dataset& dataset) {
  return grid_of_scans(dataset).has_value();
}

Result<Dataset> import_imprints(const std::filesystem::path& manifest) {
  const auto entries = read_manifest(manifest);
  if (!entries) return pass(entries.error());
  Dataset out = imported_set(manifest.stem().string(), "imprints");
  for (const ManifestEntry& entry : *entries) {
    const auto image = read_image(entry.path);
    if (!image) return pass(image.error(), entry.where);
    auto done = append_imprint(out, *image, entry.file, entry.label, entry.group);
    if (!done) return pass(std::move(done).error(), entry.where);
  }
  if (auto ok = check(out); !ok) return pass(ok.error(), manifest.string());
  return out;
}

Result<Dataset> import_imprint_table(const std::filesystem::path& table, std::size_t rows,
                                     std::size_t cols) {
  if (rows == 0 || cols == 0 || rows > classifier::imprint::most_taxels / cols)
    return fail({.code = Errc::range,
                 .where = "--shape",
                 .what = "no imprint has this size",
                 .expected = "28x50",
                 .got = std::to_string(rows) + "x" + std::to_string(cols)});
  const auto text = read_text_file(table, most_image_bytes);
  if (!text) return pass(text.error());
  NumberLines lines(table.string(), *text);
  Dataset out = imported_set(table.stem().string(), "imprint-table");
  bool first = true;
  while (lines.next()) {
    const bool heading = first && !lines.is_number(2);
    first = false;
    if (heading) continue;
    if (auto done = import_table_line(lines, rows, cols, out); !done) return pass(done.error());
  }
  if (auto ok = lines.check_end(); !ok) return pass(ok.error());
  if (out.trials.empty())
    return fail({.code = Errc::parse, .where = table.string(), .what = "no imprint in the table"});
  if (auto ok = check(out); !ok) return pass(ok.error(), table.string());
  return out;
}

}  // namespace weft::daemon
