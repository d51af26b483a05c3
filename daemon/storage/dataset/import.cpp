#include "daemon/storage/dataset/import.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <regex>
#include <set>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/dataset/trial_csv.hpp"

namespace weft::daemon {
namespace {

// The public set of Wang, Albini, Maiolino, Mastrogiovanni and Cannata 2022,
// doi 10.3389/fnbot.2022.808222.

constexpr std::size_t fabricslide_taxels = 16;

Status read_stroke(const std::filesystem::path& path, bool is_rate_stated, classifier::Trial& trial,
                   TrialRecord& record, std::vector<Warning>& warnings) {
  auto csv = CsvTable::open(path);
  if (!csv) return pass(std::move(csv).error());
  TrialColumns columns;
  // The two proximity channels measure past the fabric to the gripper: not tactile, and not used.
  for (const std::string_view name : {"proximity1", "proximity2", "timestamp"}) {
    const auto column = csv->take_column(name);
    if (!column) return pass(column.error());
    columns.time = *column;
  }
  columns.ns_per_time_unit = 1e6;  // milliseconds
  columns.is_rate_stated = is_rate_stated;
  auto channels = csv->take_series("channel");
  if (!channels) return pass(channels.error());
  columns.channels = std::move(*channels);
  if (columns.channels.size() != fabricslide_taxels)
    return csv->complaint("wrong number of channels", std::to_string(fabricslide_taxels),
                          std::to_string(columns.channels.size()));
  return read_samples(*csv, columns, trial, record, warnings);
}

/// Grips of each fabric so far. Each pair of fabric and grip was one unattended run, so it is one
/// mounting of the only piece.
using Mountings = std::map<std::string, std::vector<std::string>>;

std::uint32_t mounting_of(const std::string& fabric, const std::string& grip,
                          Mountings& mountings) {
  std::vector<std::string>& grips = mountings[fabric];
  const auto known = std::ranges::find(grips, grip);
  const auto index = static_cast<std::uint32_t>(known - grips.begin());
  if (known == grips.end()) grips.push_back(grip);
  return index + 1;
}

/// Parses fabric, grip set point, speed without direction, and repetition from a name such as
/// `Denim_F120_V-10mmps_0.csv`.
Status read_name(const std::string& name, FabricslideGroup group, Mountings& mountings,
                 classifier::Trial& trial, TrialRecord& record) {
  static const std::regex pattern(R"((.+)_F([0-9.]+)_V-?([0-9.]+)mmps_([0-9]{1,9})\.[cC][sS][vV])");
  std::smatch parts;
  if (!std::regex_match(name, parts, pattern))
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "file name does not follow this layout",
                 .expected = "<Fabric>_F<grip>_V[-]<speed>mmps_<repetition>.csv",
                 .hint = "Exclude other files with a filter"});
  trial.file = name;
  trial.label = parts[1];
  const std::string repetition = parts[4];
  trial.group = group == FabricslideGroup::pressure ? parts[2]
                : group == FabricslideGroup::speed  ? parts[3]
                                                    : parts[4];
  record.spec.place = {.piece = 1, .mounting = mounting_of(parts[1], parts[2], mountings)};
  std::from_chars(repetition.data(), repetition.data() + repetition.size(), record.spec.repetition);
  return {};
}

/// Sorted by name, so that the order does not depend on the file system.
Result<std::vector<std::filesystem::path>> matching_files(const std::filesystem::path& folder,
                                                          const std::string& filter) {
  std::error_code error;
  std::vector<std::filesystem::path> files;
  std::filesystem::directory_iterator entry(folder, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::filesystem::path& path = entry->path();
    if (is_csv_name(path) && fnmatch(filter.c_str(), path.filename().c_str(), 0) == 0)
      files.push_back(path);
  }
  if (error)
    return fail({.code = Errc::not_found,
                 .where = folder.string(),
                 .what = "folder not readable",
                 .got = error.message()});
  if (files.empty())
    return fail({.code = Errc::not_found,
                 .where = folder.string(),
                 .what = "no file matches the filter",
                 .got = filter});
  std::ranges::sort(files);
  return files;
}

// A public set of slides over 20 materials, measured with the RoboSkin of an iCub.

constexpr std::size_t triangle_taxels = 10;
constexpr std::int64_t step_ns = 20'000'000;
constexpr std::array<std::string_view, 4> named = {"sample", "label", "fold", "t"};

struct Columns {
  std::array<std::size_t, named.size()> of{};  ///< in the order of `named`
  std::vector<std::size_t> taxels;
};

Result<Columns> find_columns(CsvTable& csv) {
  Columns out;
  for (std::size_t k = 0; k < named.size(); ++k) {
    const auto column = csv.take_column(named[k]);
    if (!column) return pass(column.error());
    out.of[k] = *column;
  }
  auto taxels = csv.take_series("tx");
  if (!taxels) return pass(taxels.error());
  out.taxels = std::move(*taxels);
  if (out.taxels.size() % triangle_taxels != 0)
    return csv.complaint("wrong number of taxels", "a multiple of 10",
                         std::to_string(out.taxels.size()));
  return out;
}

struct Slide {
  classifier::Trial trial;
  TrialRecord record;
};

// Reads the step of the current line, which belongs to `slide`.
Status read_step(const CsvTable& csv, const Columns& columns, Slide& slide) {
  const auto& [sample, label, fold, t] = columns.of;
  classifier::Trial& trial = slide.trial;
  if (csv.fields()[label] != trial.label || csv.fields()[fold] != trial.group)
    return csv.complaint("label or fold changes within a slide", trial.label + ", " + trial.group,
                         csv.fields()[label] + ", " + csv.fields()[fold]);
  const std::string step = std::to_string(trial.samples());
  if (csv.fields()[t] != step) return csv.complaint("wrong step of a slide", step, csv.fields()[t]);
  if (auto done = csv.append_numbers(columns.taxels, trial.counts); !done) return done;
  slide.record.t_ns.push_back(static_cast<std::int64_t>(trial.samples()) * step_ns);
  trial.phase.push_back(Phase::motion);
  return {};
}

// See import.hpp. The ten values of frame t, triangle k are contiguous. They are filed in row group
// % steps and column group / steps, with group = triangles t + k.
void put_in_order_of_time(classifier::Trial& trial) {
  std::vector<double> frames(trial.counts.size());
  for (std::size_t j = 0; j < trial.samples(); ++j)
    for (std::size_t i = 0; i < trial.taxels / triangle_taxels; ++i) {
      const auto filed = trial.row(j).subspan(i * triangle_taxels, triangle_taxels);
      const std::size_t group = i * trial.samples() + j;
      std::ranges::copy(filed,
                        frames.begin() + static_cast<std::ptrdiff_t>(group * triangle_taxels));
    }
  trial.counts = std::move(frames);
}

// Starts the slide of the current line.
Result<Slide> begun(const CsvTable& csv, const Columns& columns, std::set<std::string>& seen) {
  const auto& [sample, label, fold, t] = columns.of;
  const std::vector<std::string>& line = csv.fields();
  for (const std::size_t column : {sample, label, fold}) {
    if (line[column].empty()) return csv.complaint("name empty");
    if (!is_utf8(line[column])) return csv.complaint("name not UTF-8", "UTF-8 text");
  }
  if (!seen.insert(line[sample]).second)
    return csv.complaint("slide " + line[sample] + " not contiguous", "all its steps together");
  Slide out;
  out.trial.file = line[sample];
  out.trial.label = line[label];
  out.trial.group = line[fold];
  out.trial.taxels = columns.taxels.size();
  return out;
}

// A missing step would shift all later values to other taxels.
Status check_steps(const CsvTable& csv, const std::vector<Slide>& slides, Icub20Order order) {
  if (order == Icub20Order::filed || slides.empty()) return {};
  const classifier::Trial& last = slides.back().trial;
  const std::size_t steps = slides.front().trial.samples();
  if (last.samples() == steps) return {};
  return csv.complaint("slide " + last.file + " differs from the first slide in steps",
                       std::to_string(steps), std::to_string(last.samples()));
}

Result<std::vector<Slide>> read_slides(CsvTable& csv, Icub20Order order) {
  const auto columns = find_columns(csv);
  if (!columns) return pass(columns.error());
  std::vector<Slide> out;
  std::set<std::string> seen;
  auto more = csv.next();
  for (; more && *more; more = csv.next()) {
    if (out.empty() || out.back().trial.file != csv.fields()[columns->of[0]]) {
      if (auto done = check_steps(csv, out, order); !done) return pass(done.error());
      auto slide = begun(csv, *columns, seen);
      if (!slide) return pass(slide.error());
      out.push_back(std::move(*slide));
    }
    if (auto done = read_step(csv, *columns, out.back()); !done) return pass(done.error());
  }
  if (!more) return pass(more.error());
  if (auto done = check_steps(csv, out, order); !done) return pass(done.error());
  if (out.empty()) return csv.complaint("no slides after the header");
  return out;
}

// Reads the file `trial.file` and adds it to the set.
Status read_trial(Result<CsvTable> csv, classifier::Trial trial, TrialRecord record,
                  bool is_rate_stated, Dataset& dataset) {
  if (!csv) return pass(std::move(csv).error());
  TrialColumns columns;
  const auto time = csv->take_column("t_s");
  if (!time) return pass(time.error());
  columns.time = *time;
  columns.phase = csv->find_column("phase");
  columns.is_rate_stated = is_rate_stated;
  auto channels = csv->take_series("ch");
  if (!channels) return pass(channels.error());
  columns.channels = std::move(*channels);
  if (auto done = read_samples(*csv, columns, trial, record, dataset.warnings); !done) return done;
  return append(dataset, std::move(trial), std::move(record));
}

Status import_entry(const ManifestEntry& entry, bool is_rate_stated, Dataset& dataset) {
  classifier::Trial trial;
  TrialRecord record;
  trial.file = entry.file;
  trial.label = entry.label;
  trial.group = entry.group;
  record.spec.place = entry.place;
  record.spec.group_values = entry.group_values;
  auto done = read_trial(CsvTable::open(entry.path), std::move(trial), std::move(record),
                         is_rate_stated, dataset);
  if (!done) return pass(std::move(done).error(), entry.where);
  return {};
}

Result<Dataset> one_trial(const std::filesystem::path& name, Result<CsvTable> csv) {
  Dataset dataset;
  dataset.info.name = name.stem().string();
  dataset.info.source = "trial";
  classifier::Trial trial;
  trial.file = name.string();
  if (auto done = read_trial(std::move(csv), std::move(trial), {}, false, dataset); !done)
    return pass(std::move(done).error());
  dataset.info.taxel_rate_hz = common_rate_hz(dataset);
  return dataset;
}

/// Like printf's %.17g, which restores the same double, but independent of the locale.
void append_number(std::string& text, double value) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                          std::chars_format::general, 17);
  WEFT_ASSERT(error == std::errc());
  text.append(digits.data(), end);
}

}  // namespace

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

Result<Dataset> import_fabricslide(const std::filesystem::path& folder, std::string_view filter,
                                   FabricslideGroup group, double rate_hz) {
  auto files = matching_files(folder, std::string(filter));
  if (!files) return pass(std::move(files).error());
  Dataset dataset = imported_set("fabricslide", "fabricslide", BenchKind::real);
  Mountings mountings;
  for (const std::filesystem::path& path : *files) {
    classifier::Trial trial;
    TrialRecord record;
    auto done = read_name(path.filename().string(), group, mountings, trial, record);
    if (done) done = read_stroke(path, rate_hz > 0, trial, record, dataset.warnings);
    if (done) done = append(dataset, std::move(trial), std::move(record));
    if (!done) return pass(std::move(done).error());
  }
  if (auto done = settle_rate(dataset, rate_hz); !done) return pass(done.error(), folder.string());
  return dataset;
}

Result<Dataset> import_icub20(const std::filesystem::path& path, Icub20Order order) {
  auto csv = CsvTable::open(path);
  if (!csv) return pass(csv.error());
  auto slides = read_slides(*csv, order);
  if (!slides) return pass(slides.error());
  Dataset dataset = imported_set(order == Icub20Order::time ? "icub20" : "icub20 as filed",
                                 "icub20", BenchKind::real);
  for (Slide& slide : *slides) {
    if (order == Icub20Order::time) put_in_order_of_time(slide.trial);
    if (auto done = append(dataset, std::move(slide.trial), std::move(slide.record)); !done)
      return pass(done.error());
  }
  dataset.info.taxel_rate_hz = common_rate_hz(dataset);
  return dataset;
}

Result<Dataset> import_manifest(const std::filesystem::path& path, double rate_hz,
                                std::optional<BenchKind> bench) {
  const auto manifest = read_manifest(path, ManifestKind::trials, bench);
  if (!manifest) return pass(manifest.error());
  Dataset dataset = imported_set(path.stem().string(), "manifest", manifest->bench);
  dataset.info.group_columns = manifest->group_columns;
  for (const ManifestEntry& entry : manifest->entries)
    if (auto done = import_entry(entry, rate_hz > 0, dataset); !done)
      return pass(std::move(done).error());
  if (auto done = settle_rate(dataset, rate_hz); !done) return pass(done.error(), path.string());
  return dataset;
}

Result<Dataset> import_trial(const std::filesystem::path& path) {
  return one_trial(path, CsvTable::open(path));
}

Result<Dataset> import_trial_text(std::string name, std::string text) {
  return one_trial(name, CsvTable::from_text(name, std::move(text)));
}

FactorColumns factor_columns(const Dataset& dataset, const classifier::FeatureMatrix& features) {
  if (dataset.info.factors.empty()) return {};
  std::map<std::string_view, const std::vector<double>*> of_file;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    of_file[dataset.trials[i].file] = &dataset.records[i].spec.factors;
  FactorColumns out{dataset.info.factors, {}};
  for (const std::string& file : features.files) {
    auto found = of_file.find(file);
    if (found == of_file.end()) found = of_file.find(classifier::recording_of(file));
    if (found == of_file.end()) return {};
    out.values.push_back(*found->second);
  }
  return out;
}

Status export_features_csv(const std::filesystem::path& path,
                           const classifier::FeatureMatrix& features,
                           const FactorColumns& factors) {
  if (auto fine = classifier::check(features); !fine)
    return pass(std::move(fine).error(), path.string());
  std::string text = "file,label,group";
  for (const std::string& name : factors.names) text += "," + csv_field(name);
  for (const std::string& name : features.names) text += "," + csv_field(name);
  text += '\n';
  for (std::size_t i = 0; i < features.size(); ++i) {
    text += csv_field(features.files[i]) + "," + csv_field(features.labels[i]) + "," +
            csv_field(features.groups[i]);
    const auto add = [&text](double value) {
      text += ',';
      append_number(text, value);
    };
    if (!factors.names.empty()) std::ranges::for_each(factors.values[i], add);
    std::ranges::for_each(features.values.row(i), add);
    text += '\n';
  }
  return write_text_file(path, text);
}

}  // namespace weft::daemon
