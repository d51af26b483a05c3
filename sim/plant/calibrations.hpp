#pragma once
// Calibrations in a fabric table: facts about the recordings to which it was fitted.

#include <nlohmann/json_fwd.hpp>

#include "protocols/base/result.hpp"

namespace weft::sim {

/// Checks the entries of `/calibrations` that programs read, if present: `dataset_sha256` (texts),
/// `counts_scale` (above 0) and `parameters` (name, cloth and standing as texts, value as a
/// number). Errors: parse, with a JSON pointer.
Status check_calibrations(const nlohmann::json& calibrations);

}  // namespace weft::sim
