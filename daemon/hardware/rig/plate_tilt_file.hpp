#pragma once
// The plate's level as `weft align --json` found it, and how a campaign is given it.

#include <chrono>
#include <string>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// The rig file `rig_json` with the rotary stages' angles of `align_json` in plate.level, where
/// campaigns read them and data sets keep them. `now_utc` is told, as is `oldest`; zero: of
/// any age, and found by a clock that was ahead of this one.
/// Errors: parse (no JSON, not what weft align says), wrong_state (not levelled, another rig or
/// kind of bench, too old, or of the future), invalid_argument (the rig file has a level already).
Result<std::string> with_level(std::string_view rig_json, std::string_view align_json,
                               std::chrono::nanoseconds now_utc, std::chrono::seconds oldest);

}  // namespace weft::daemon
