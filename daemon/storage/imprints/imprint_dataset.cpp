#include "daemon/storage/imprints/imprint_dataset.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/base/text/csv_table.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/base/text/similar_names.hpp"
#include "daemon/storage/dataset/trial_csv.hpp"
#include "daemon/storage/imprints/image_file.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {
namespace {

using classifier::imprint::Image;
using classifier::imprint::Imprint;
using classifier::imprint::TaxelGrid;
using nlohmann::json;

/// Reads the array that the scene `imprint` recorded, see imprint_scene.hpp.
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

// All imprints of a set come from one array.
Status check_size(const classifier::Trial& first, std::size_t rows, std::size_t cols,
                  const std::string& file) {
  if (first.samples() == rows && first.taxels == cols) return {};
  return fail({.code = Errc::invalid_argument,
               .where = file,
               .what = "imprints differ in size",
               .expected = format_size(first.samples(), first.taxels) + " as in " + first.file,
               .got = format_size(rows, cols),
               .hint = "Make one data set for each array"});
}

/// A whole number as a device reports it; nothing for other text.
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

/// Class of each object; empty if there is no recipe or it has no classes.
Result<std::map<std::string, std::string>> classes_on_record(const DatasetInfo& info) {
  std::map<std::string, std::string> out;
  if (info.recipe_json.empty() || info.rig_json.empty()) return out;
  const auto limits = recipes::parse_rig_limits(info.rig_json);
  if (!limits) return pass(limits.error());
  const recipes::CheckReport report = recipes::check_recipe(info.recipe_json, *limits);
  if (!report.plan)
    return fail(
        {.code = Errc::corrupt,
         .what = "recorded recipe not readable: " + recipes::to_string(report.problems.front())});
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
                 .hint = "Make phase P longer than the scan period of the array"});
  const auto at = static_cast<std::size_t>(trial.phase.rend() - last - 1);
  Image image(grid.rows, grid.cols);
  const auto first = trial.counts.begin() + static_cast<std::ptrdiff_t>(at * trial.taxels);
  std::copy_n(first, trial.taxels, image.data().begin());
  return image;
}

/// The first device array with as many taxels as the trials; nothing for an empty set.
std::optional<TaxelGrid> grid_of_scans(const Dataset& dataset) {
  if (dataset.trials.empty()) return std::nullopt;
  for (const DeviceInfo& device : dataset.info.devices)
    if (const auto grid = find_grid(device, dataset.trials.front().taxels)) return grid;
  return std::nullopt;
}

/// One imprint per complete trial, in order. Its object is the trial's label (the fabric). Its
/// label is the class of that object in the recorded recipe, or the object if the recipe has no
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

/// Field numbers in a line of a table.
struct TableColumns {
  std::size_t label = 0, group = 1;
  std::vector<std::size_t> values;  ///< row by row
};

/// True for names that share a prefix and have numbers that do not increase, as text sorts 10
/// before 2.
bool is_out_of_order(const std::vector<std::string>& header,
                     const std::vector<std::size_t>& columns) {
  std::string_view prefix;
  double before = -1;
  bool out = false;
  for (const std::size_t c : columns) {
    const std::string_view name = header[c];
    const std::size_t digits = name.find_last_not_of("0123456789") + 1;
    double number = 0;
    const auto [end, error] =
        std::from_chars(name.data() + digits, name.data() + name.size(), number);
    if (error != std::errc() || (before >= 0 && name.substr(0, digits) != prefix)) return false;
    out |= number <= before;
    prefix = name.substr(0, digits);
    before = number;
  }
  return out;
}

/// With a heading, columns are found by name, and each line has `width` fields: `label`, then
/// `group` or else the first other column, then the values in the remaining order. Without a
/// heading, columns are found by position.
Result<TableColumns> find_table_columns(CsvTable& csv, std::size_t width) {
  TableColumns out;
  const std::vector<std::string>& header = csv.header();
  if (!header.empty()) {
    const auto label = csv.take_column("label");
    if (!label) return pass(label.error());
    for (const char* name : {"label", "group"})
      if (std::ranges::count(header, name) > 1)
        return csv.complaint("column name repeated", {}, name);
    out.label = *label;
    out.group = csv.find_column("group").value_or(*label == 0 ? 1 : 0);
    const bool is_whole = header.size() == width;
    if (!is_whole && (header.size() > width || out.label + out.group != 1))
      return csv.complaint("wrong number of names in the header", std::to_string(width),
                           std::to_string(header.size()),
                           "Name every column, or only label and group as the first two");
  }
  for (std::size_t i = 0; i < width; ++i)
    if (i != out.label && i != out.group) out.values.push_back(i);
  if (header.size() == width && is_out_of_order(header, out.values))
    return csv.complaint("value columns out of order", "ascending numbers", {},
                         "Sort the columns by number, not as text");
  return out;
}

Status import_table_line(CsvTable& csv, const TableColumns& columns, std::size_t rows,
                         std::size_t cols, Dataset& dataset) {
  const std::string &label = csv.fields()[columns.label], &group = csv.fields()[columns.group];
  if (is_invisible(label)) return csv.complaint("label empty");
  if (!is_utf8(label) || !is_utf8(group)) return csv.complaint("name not UTF-8", "UTF-8 text");
  std::vector<double> values;
  if (auto done = csv.append_numbers(columns.values, values); !done) return done;
  Image image(rows, cols);
  std::ranges::copy(values, image.data().begin());
  auto done = append_imprint(dataset, image,
                             label + "/" + group + "#" + std::to_string(dataset.trials.size()),
                             label, group);
  if (!done) return pass(std::move(done).error(), csv.where());
  return {};
}

/// True for n, n + 1, n + 2, ...: column numbers, which programs write for columns without names.
bool count_up(std::span<const double> values) {
  constexpr std::size_t fewest = 3;
  if (values.size() < fewest) return false;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (values[i] != values[i - 1] + 1) return false;
  return true;
}

/// Detects a first row that is a heading with numbers as names: its values count up, and no other
/// row has its label. It is refused if the values start at 0 or continue the numbers of label and
/// group, as programs number unnamed columns.
Status check_first_row(const std::string& table, Dataset& dataset) {
  const classifier::Trial& first = dataset.trials.front();
  const auto is_alike = [&](const classifier::Trial& t) { return t.label == first.label; };
  if (dataset.trials.size() == 1 || !count_up(first.counts) ||
      std::ranges::count_if(dataset.trials, is_alike) > 1)
    return {};
  const double begin = first.counts.front();
  const bool is_counted_on = first.label == general(begin - 2) && first.group == general(begin - 1);
  if (begin != 0 && !is_counted_on) {
    dataset.warnings.push_back({"numbered_row", table + ": the values of the first row count up; "
                                                        "remove the row if it is a header"});
    return {};
  }
  return fail({.code = Errc::parse,
               .where = table,
               .what = "first row counts up and may be a header",
               .got = first.label + ", " + first.group + ", ...",
               .hint = "Remove the row, or name its first two columns label and group"});
}

bool is_heading(std::span<const double> values) {
  return (values.front() == 0 || values.front() == 1) && count_up(values);
}

/// Warns of a matrix that seems to contain the numbers of its columns or rows, or to be one column
/// with decimal commas.
void warn_of_odd_table(const Image& image, const std::string& file,
                       std::vector<Warning>& warnings) {
  std::vector<double> column;
  for (std::size_t r = 0; r < image.rows(); ++r) column.push_back(image(r, 0));
  if (image.rows() > 1 && is_heading(image.row(0)))
    warnings.push_back({"numbered_row", file + ": the first row counts up; remove it if it "
                                               "is a header"});
  if (image.cols() > 1 && is_heading(column))
    warnings.push_back({"numbered_column", file + ": the first column counts up; remove it if it "
                                                  "has row numbers"});
  const auto is_whole = [](double v) { return v >= 0 && v == std::floor(v); };
  if (image.cols() == 2 && is_csv_name(file) && std::ranges::all_of(image.data(), is_whole))
    warnings.push_back({"two_columns", file + ": all rows have two whole numbers; if the commas "
                                              "are decimal marks, use points"});
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
                 .what = "data set contains other trials than imprints",
                 .expected = "trials of exploration imprint",
                 .got = dataset.info.source,
                 .hint = "See `weft dataset import --help`"});
  if (const auto grid = grid_of_scans(dataset)) return imprints_of_scans(dataset, *grid);
  // Objects may be numbered within their class; then a group's name alone does not identify an
  // object.
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
                 .what = "too few imprints",
                 .expected = "at least 1",
                 .got = "0"});
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

Result<Dataset> import_imprints(const std::filesystem::path& path, std::optional<BenchKind> bench) {
  const auto manifest = read_manifest(path, ManifestKind::files, bench);
  if (!manifest) return pass(manifest.error());
  Dataset out = imported_set(path.stem().string(), "imprints", manifest->bench);
  out.info.group_columns = manifest->group_columns;
  for (const ManifestEntry& entry : manifest->entries) {
    const auto image = read_image(entry.path);
    if (!image) return pass(image.error(), entry.where);
    if (entry.path.extension() != ".pgm") warn_of_odd_table(*image, entry.file, out.warnings);
    auto done = append_imprint(out, *image, entry.file, entry.label, entry.group);
    if (!done) return pass(std::move(done).error(), entry.where);
    out.records.back().spec.group_values = entry.group_values;
  }
  if (auto ok = check(out); !ok) return pass(ok.error(), path.string());
  return out;
}

Result<Dataset> import_imprint_table(const std::filesystem::path& table, std::size_t rows,
                                     std::size_t cols, BenchKind bench) {
  if (rows == 0 || cols == 0 || rows > classifier::imprint::most_taxels / cols)
    return fail({.code = Errc::range,
                 .where = "--shape",
                 .what = "imprint size out of range",
                 .expected = "28x50",
                 .got = std::to_string(rows) + "x" + std::to_string(cols)});
  const std::size_t width = 2 + rows * cols;
  auto csv = CsvTable::open(
      table, {.heading = CsvRules::Heading::if_label,
              .hash = CsvRules::Hash::text_in_width,
              .tabs_or_blanks = true,
              .width = width,
              .layout = "label, group and " + std::to_string(rows * cols) + " values",
              .most_columns = 2 + classifier::imprint::most_taxels,
              .most_line_bytes = CsvTable::max_file_bytes});
  if (!csv) return pass(csv.error());
  const auto columns = find_table_columns(*csv, width);
  if (!columns) return pass(columns.error());
  Dataset out = imported_set(table.stem().string(), "imprint-table", bench);
  auto more = csv->next();
  for (; more && *more; more = csv->next())
    if (auto done = import_table_line(*csv, *columns, rows, cols, out); !done)
      return pass(done.error());
  if (!more) return pass(more.error());
  if (out.trials.empty())
    return fail(
        {.code = Errc::parse, .where = table.string(), .what = "table contains no imprint"});
  if (auto ok = check_first_row(table.string(), out); !ok) return pass(ok.error());
  if (auto ok = check(out); !ok) return pass(ok.error(), table.string());
  for (Warning& one : csv->warnings()) out.warnings.push_back(std::move(one));
  return out;
}

}  // namespace weft::daemon
