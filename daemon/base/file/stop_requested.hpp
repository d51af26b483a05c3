#pragma once
// Reading a large file may be given up.

#include <functional>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// True: give up. Called often, on the thread that reads; empty: never.
using StopRequested = std::function<bool()>;

inline Error stopped_early(std::string where) {
  return {.code = Errc::wrong_state,
          .where = std::move(where),
          .what = "stopped before all of it was read"};
}

}  // namespace weft::daemon
