#include <set>

#include "daemon/dataset/import.hpp"
#include "daemon/dataset/trial_csv.hpp"

namespace weft::daemon {
namespace {

struct ManifestColumns {
  std::size_t file = 0;
  std::size_t label = 0;
  std::optional<std::size_t> group;
};

Result<ManifestColumns> read_columns(const CsvReader& manifest) {
  for (const std::string& name : manifest.header())
    if (name != "file" && name != "label" && name != "group")
      return manifest.complaint("unknown column '" + name.substr(0, 40) + "'",
                                "file, label and perhaps group");
  const auto file = find_column(manifest, "file");
  const auto label = find_column(manifest, "label");
  if (!file || !label)
    return manifest.complaint(std::string("the column ") + (file ? "label" : "file") +
                              " is missing");
  return ManifestColumns{*file, *label, find_column(manifest, "group")};
}

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

/// The trial of the manifest's current line.
Status import_line(const CsvReader& manifest, const ManifestColumns& columns,
                   const std::filesystem::path& folder, std::set<std::filesystem::path>& seen,
                   Dataset& dataset) {
  classifier::Trial trial;
  TrialRecord record;
  trial.file = manifest.fields()[columns.file];
  trial.label = manifest.fields()[columns.label];
  if (columns.group) trial.group = manifest.fields()[*columns.group];
  if (trial.file.empty()) return manifest.complaint("the file name is empty");
  if (trial.label.empty()) return manifest.complaint("the label is empty");
  const std::filesystem::path path = (folder / trial.file).lexically_normal();
  if (!seen.insert(path).second)
    return manifest.complaint("the file is listed twice", {}, trial.file);
  auto done = read_trial(CsvReader::open(path), trial, record);
  if (done) done = append(dataset, std::move(trial), std::move(record));
  if (!done) return pass(std::move(done).error(), manifest.where());
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
  dataset.info.taxel_rate_hz = mean_rate_hz(dataset);
  return dataset;
}

}  // namespace

Result<Dataset> import_manifest(const std::filesystem::path& path) {
  auto manifest = CsvReader::open(path);
  if (!manifest) return pass(std::move(manifest).error());
  const auto columns = read_columns(*manifest);
  if (!columns) return pass(columns.error());
  Dataset dataset;
  dataset.info.name = path.stem().string();
  dataset.info.source = "manifest";
  dataset.info.software_version = WEFT_VERSION;
  std::set<std::filesystem::path> seen;
  auto more = manifest->next();
  for (; more && *more; more = manifest->next()) {
    auto done = import_line(*manifest, *columns, path.parent_path(), seen, dataset);
    if (!done) return pass(std::move(done).error());
  }
  if (!more) return pass(std::move(more).error());
  if (dataset.trials.empty()) return manifest->complaint("a header but no trials");
  dataset.info.taxel_rate_hz = mean_rate_hz(dataset);
  return dataset;
}

Result<Dataset> import_trial(const std::filesystem::path& path) {
  return one_trial(path, CsvReader::open(path));
}

Result<Dataset> import_trial_text(std::string name, std::string text) {
  return one_trial(name, CsvReader::from_text(name, std::move(text)));
}

}  // namespace weft::daemon
