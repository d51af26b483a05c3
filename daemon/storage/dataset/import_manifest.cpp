#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/dataset/trial_csv.hpp"

namespace weft::daemon {
namespace {

Status read_trial(Result<CsvReader> csv, classifier::Trial& trial, TrialRecord& record) {
  if (!csv) return pass(std::move(csv).error());
  std::vector<bool> taken(csv->header().size(), false);
  TrialColumns columns;
  const auto time = find_column(*csv, "t_s");
  if (!time) return csv->complaint("the column t_s is missing");
  columns.time = *time;
  taken[*time] = true;
  columns.phase = find_column(*csv, "phase");
  if (columns.phase) taken[*columns.phase] = true;
  if (auto done = find_channels(*csv, "ch", taken, columns.channels); !done) return done;
  return read_samples(*csv, columns, trial, record);
}

Status import_entry(const ManifestEntry& entry, Dataset& dataset) {
  classifier::Trial trial;
  TrialRecord record;
  trial.file = entry.file;
  trial.label = entry.label;
  trial.group = entry.group;
  auto done = read_trial(CsvReader::open(entry.path), trial, record);
  if (done) done = append(dataset, std::move(trial), std::move(record));
  if (!done) return pass(std::move(done).error(), entry.where);
  return {};
}

Result<Dataset> one_trial(const std::filesystem::path& name, Result<CsvReader> csv) {
  Dataset dataset;
  dataset.info.name = name.stem().string();
  dataset.info.source = "trial";
  classifier::Trial trial;
  TrialRecord record;
  trial.file = name.string();
  if (auto done = read_trial(std::move(csv), trial, record); !done)
    return pass(std::move(done).error());
  if (auto done = append(dataset, std::move(trial), std::move(record)); !done)
    return pass(std::move(done).error());
  dataset.info.taxel_rate_hz = common_rate_hz(dataset);
  return dataset;
}

}  // namespace

Result<Dataset> import_manifest(const std::filesystem::path& path, double rate_hz) {
  const auto entries = read_manifest(path);
  if (!entries) return pass(entries.error());
  Dataset dataset;
  dataset.info.name = path.stem().string();
  dataset.info.source = "manifest";
  dataset.info.software_version = software_version();
  for (const ManifestEntry& entry : *entries)
    if (auto done = import_entry(entry, dataset); !done) return pass(std::move(done).error());
  if (auto done = settle_rate(dataset, rate_hz); !done) return pass(done.error(), path.string());
  return dataset;
}

Result<Dataset> import_trial(const std::filesystem::path& path) {
  return one_trial(path, CsvReader::open(path));
}

Result<Dataset> import_trial_text(std::string name, std::string text) {
  return one_trial(name, CsvReader::from_text(name, std::move(text)));
}

}  // namespace weft::daemon
