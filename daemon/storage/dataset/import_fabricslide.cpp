// The public set of Wang, Albini, Maiolino, Mastrogiovanni and Cannata 2022,
// doi 10.3389/fnbot.2022.808222.
#include <fnmatch.h>

#include <algorithm>
#include <charconv>
#include <regex>

#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/dataset/trial_csv.hpp"

namespace weft::daemon {
namespace {

constexpr std::size_t fabricslide_taxels = 16;

Status read_stroke(const std::filesystem::path& path, classifier::Trial& trial,
                   TrialRecord& record) {
  auto csv = CsvReader::open(path);
  if (!csv) return pass(std::move(csv).error());
  std::vector<bool> taken(csv->header().size(), false);
  // The two proximity channels look past the cloth at the gripper: not tactile, and not used.
  for (const std::string_view name : {"timestamp", "proximity1", "proximity2"}) {
    const auto column = find_column(*csv, name);
    if (!column) return csv->complaint("the column " + std::string(name) + " is missing");
    taken[*column] = true;
  }
  TrialColumns columns;
  columns.time = *find_column(*csv, "timestamp");
  columns.ns_per_time_unit = 1e6;  // milliseconds
  if (auto done = find_channels(*csv, "channel", taken, columns.channels); !done) return done;
  if (columns.channels.size() != fabricslide_taxels)
    return csv->complaint("wrong number of channels", std::to_string(fabricslide_taxels),
                          std::to_string(columns.channels.size()));
  return read_samples(*csv, columns, trial, record);
}

/// Fabric, grip set-point, speed without its direction and repetition, from a name such as
/// `Denim_F120_V-10mmps_0.csv`.
Status read_name(const std::string& name, FabricslideGroup group, classifier::Trial& trial,
                 TrialRecord& record) {
  static const std::regex pattern(R"((.+)_F([0-9.]+)_V-?([0-9.]+)mmps_([0-9]{1,9})\.[cC][sS][vV])");
  std::smatch parts;
  if (!std::regex_match(name, parts, pattern))
    return fail({.code = Errc::parse,
                 .where = name,
                 .what = "not a name of this layout",
                 .expected = "<Fabric>_F<grip>_V[-]<speed>mmps_<repetition>.csv",
                 .hint = "Leave other files out with a filter"});
  trial.file = name;
  trial.label = parts[1];
  const std::string repetition = parts[4];
  switch (group) {
    case FabricslideGroup::repetition:
      trial.group = repetition;
      break;
    case FabricslideGroup::pressure:
      trial.group = parts[2];
      break;
    case FabricslideGroup::speed:
      trial.group = parts[3];
      break;
  }
  std::from_chars(repetition.data(), repetition.data() + repetition.size(), record.spec.repetition);
  return {};
}

/// In the order of their names, whatever the file system's is.
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
                 .what = "cannot list the folder",
                 .got = error.message()});
  if (files.empty())
    return fail({.code = Errc::not_found,
                 .where = folder.string(),
                 .what = "no file matches the filter",
                 .got = filter});
  std::ranges::sort(files);
  return files;
}

}  // namespace

Result<Dataset> import_fabricslide(const std::filesystem::path& folder, std::string_view filter,
                                   FabricslideGroup group, double rate_hz) {
  auto files = matching_files(folder, std::string(filter));
  if (!files) return pass(std::move(files).error());
  Dataset dataset;
  dataset.info.kind = BenchKind::real;
  dataset.info.name = "fabricslide";
  dataset.info.source = "fabricslide";
  dataset.info.software_version = software_version();
  for (const std::filesystem::path& path : *files) {
    classifier::Trial trial;
    TrialRecord record;
    auto done = read_name(path.filename().string(), group, trial, record);
    if (done) done = read_stroke(path, trial, record);
    if (done) done = append(dataset, std::move(trial), std::move(record));
    if (!done) return pass(std::move(done).error());
  }
  if (auto done = settle_rate(dataset, rate_hz); !done) return pass(done.error(), folder.string());
  return dataset;
}

}  // namespace weft::daemon
