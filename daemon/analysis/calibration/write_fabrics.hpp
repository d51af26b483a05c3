#pragma once
// The calibrated fabric table, format weft-fabrics-2 (sim/plant/fabric.cpp): the initial table with
// one more fabric per label. `sensor`, `spread` and `parameters` are from the result, and an object
// in `calibrations` records the origin.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/analysis/calibration/calibrate.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::calibration {

/// Conditions of the calibration; recorded only.
struct CalibrationSource {
  std::string prefix;  ///< prefix of the fabric names: "fabricslide" gives "fabricslide.denim"
  std::vector<std::string> files, dataset_sha256;  ///< same order
  BenchKind bench = BenchKind::unknown;            ///< bench of the recordings; if they differ:
                                                   ///< unknown
  std::string held_out_file;                       ///< empty: part of `files`
  std::string software, commit, nlopt, command;
};

/// The name of a label's calibrated fabric in the table: "fabricslide.denim" for "Denim".
std::string name_in_table(const std::string& prefix, const std::string& label);

/// "C1", or the next number not used in the table.
std::string next_calibration(const nlohmann::ordered_json& table);

/// `table`: text that sim::parse_fabrics() accepts. An earlier fabric of the same name is replaced.
/// A parameter seen by an earlier calibration but not by this one is kept. Errors: parse for other
/// text.
Result<nlohmann::ordered_json> calibrated_table(std::string_view table,
                                                const CalibrationResult& result,
                                                const CalibrationSource& source);

/// The table as readable text: values that fit on one line are written on one.
std::string table_text(const nlohmann::ordered_json& table);

/// The result for programs: {bench, passes, held_out, parameters, statistics, ...}; natural scale.
nlohmann::ordered_json calibration_json(const CalibrationResult& result,
                                        const CalibrationSource& source);

}  // namespace weft::daemon::calibration
