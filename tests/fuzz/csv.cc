// Comma-separated files: as lines, as a trial, as a manifest, as tables of strokes and of imprints.

#include <array>
#include <cmath>

#include "daemon/base/text/csv_table.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz::csv_target {
namespace {

using namespace weft::daemon;

// All kinds of rules that the imports use.
const std::array<CsvRules, 4> all_rules{{
    {},
    {.heading = CsvRules::Heading::if_label,
     .hash = CsvRules::Hash::text_in_width,
     .tabs_or_blanks = true,
     .width = 6},
    {.heading = CsvRules::Heading::never, .hash = CsvRules::Hash::comment, .tabs_or_blanks = true},
    {.heading = CsvRules::Heading::never, .equal_lines = false},
}};

void read_lines(const std::string& text, const CsvRules& rules) {
  auto csv = CsvTable::from_text("input", text, rules);
  if (!csv) return demand(!csv.error().what.empty(), "an error says what is wrong");
  if (!csv->header().empty() && !csv->take_column("t_s"))
    demand(csv->take_rest().size() == csv->header().size(), "what is not found is not taken");
  std::size_t width = rules.width;
  auto more = csv->next();
  for (; more && *more; more = csv->next()) {
    const std::size_t fields = csv->fields().size();
    demand(fields > 0, "a line has a field");
    if (rules.heading == CsvRules::Heading::always) width = csv->header().size();
    if (width == 0) width = fields;
    demand(fields == width || !rules.equal_lines, "all lines have as many fields");
    for (std::size_t column = 0; column < fields; ++column) {
      const auto number = csv->number(column);
      demand(!number || std::isfinite(*number), "numbers are finite");
    }
  }
  demand(more || more.error().where.starts_with("input:"), "a complaint has its line");
  for (const Warning& one : csv->warnings()) demand(!one.text.empty(), "a warning says of what");
}

void read_dataset(Result<Dataset> dataset) {
  if (!dataset) return demand(!dataset.error().what.empty(), "an error says what is wrong");
  demand(!dataset->trials.empty(), "a data set that was read has a trial");
  for (classifier::Trial& trial : dataset->trials)  // a single trial has no label
    if (trial.label.empty()) trial.label = "unknown";
  demand(check(*dataset).has_value(), "a data set that was read keeps its promises");
  demand(std::isfinite(dataset->info.taxel_rate_hz), "rates are finite");
  demand(dataset_sha256(*dataset).size() == 64, "a data set that was read has a digest");
}

}  // namespace

WEFT_FUZZ_TARGET(csv) {
  const MemoryFile file({data, size});
  for (const CsvRules& rules : all_rules)
    read_lines(std::string(reinterpret_cast<const char*>(data), size), rules);
  read_dataset(weft::daemon::import_trial(file.path()));
  read_dataset(weft::daemon::import_manifest(file.path()));
  read_dataset(weft::daemon::import_icub20(file.path()));
  read_dataset(weft::daemon::import_imprint_table(file.path(), 2, 2));
  return 0;
}

}  // namespace weft::fuzz::csv_target
