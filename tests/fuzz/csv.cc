// Comma-separated files: as lines, as a trial, as a manifest and as a table of slides.

#include <cmath>

#include "daemon/base/text/csv.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz::csv_target {
namespace {

using namespace weft::daemon;

void read_lines(const std::filesystem::path& path) {
  auto csv = CsvReader::open(path);
  if (!csv) return demand(!csv.error().what.empty(), "an error says what is wrong");
  auto more = csv->next();
  for (; more && *more; more = csv->next()) {
    demand(csv->fields().size() == csv->header().size(), "a line has the header's fields");
    for (std::size_t column = 0; column < csv->fields().size(); ++column) {
      const auto number = csv->number(column);
      demand(!number || std::isfinite(*number), "numbers are finite");
    }
  }
}

void read_dataset(Result<Dataset> dataset) {
  if (!dataset) return demand(!dataset.error().what.empty(), "an error says what is wrong");
  demand(!dataset->trials.empty(), "a data set that was read has a trial");
  for (classifier::Trial& trial : dataset->trials)  // a single trial comes without one
    if (trial.label.empty()) trial.label = "unknown";
  demand(check(*dataset).has_value(), "a data set that was read keeps its promises");
  demand(std::isfinite(dataset->info.taxel_rate_hz), "rates are finite");
  demand(dataset_sha256(*dataset).size() == 64, "a data set that was read has a digest");
}

}  // namespace

WEFT_FUZZ_TARGET(csv) {
  const MemoryFile file({data, size});
  read_lines(file.path());
  read_dataset(weft::daemon::import_trial(file.path()));
  read_dataset(weft::daemon::import_manifest(file.path()));
  read_dataset(weft::daemon::import_icub20(file.path()));
  return 0;
}

}  // namespace weft::fuzz::csv_target
