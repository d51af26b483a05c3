#pragma once
// What "rig" events carry.

#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "daemon/service/run_store/run_store.hpp"

namespace weft::daemon::api {

/// How the rig stands by now, and by whose word or act; null where a reason is gone.
nlohmann::json rig_delta(const runs::RigState& rig, std::string_view by);

}  // namespace weft::daemon::api
