#pragma once
// The calibrated cloth table, format weft-fabrics-2 (sim/README.md): the table that it began from,
// with one cloth more per label, `sensor`, `spread` and `parameters` from the result, and an object
// in `calibrations` that says where all this comes from.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/analysis/calibration/calibrate.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::calibration {

/// What was calibrated with; only written down.
struct CalibrationSource {
  std::string prefix;  ///< of the cloths' names: "fabricslide" gives "fabricslide.denim"
  std::vector<std::string> files, dataset_sha256;  ///< side by side
  BenchKind bench = BenchKind::unknown;            ///< of the recordings; several kinds: unknown
  std::string held_out_file;                       ///< empty: part of `files`
  std::string software, commit, nlopt, command;
};

/// What the table calls the calibrated cloth of a label: "fabricslide.denim" of "Denim".
std::string name_in_table(const std::string& prefix, const std::string& label);

/// "C1", or the next number that the table does not have.
std::string next_calibration(const nlohmann::ordered_json& table);

/// `table`: text that sim::parse_fabrics() accepts. An earlier cloth of the same name is replaced;
/// a parameter that an earlier calibration saw and this one did not is left. Errors: parse, for
/// other text.
Result<nlohmann::ordered_json> calibrated_table(std::string_view table,
                                                const CalibrationResult& result,
                                                const CalibrationSource& source);

/// The table as a file to read: what fits on a line is on one.
std::string table_text(const nlohmann::ordered_json& table);

/// The result for programs: {bench, passes, held_out, parameters, statistics, ...}; natural scale.
nlohmann::ordered_json calibration_json(const CalibrationResult& result,
                                        const CalibrationSource& source);

}  // namespace weft::daemon::calibration
