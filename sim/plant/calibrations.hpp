#pragma once
// What a cloth table says of the recordings that it was fitted to.

#include <nlohmann/json_fwd.hpp>

#include "protocols/base/result.hpp"

namespace weft::sim {

/// Of each of `/calibrations` what programs read where it is there: `dataset_sha256` (texts),
/// `counts_scale` (over 0) and `parameters` (name, cloth and standing as texts, value as a number).
/// Errors: parse, with a JSON pointer.
Status check_calibrations(const nlohmann::json& calibrations);

}  // namespace weft::sim
