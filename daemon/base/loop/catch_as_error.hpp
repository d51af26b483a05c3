#pragma once
// What escapes a thread of its own ends the work of that thread and nothing else.

#include <exception>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// What `work` returns, a Result; where it throws, wrong_state with the name of `what` that ended,
/// a run or another thing, and what was thrown.
template <class Work>
auto catch_as_error(const Work& work, const std::string& what = "run") -> decltype(work()) {
  const std::string ours = "a mistake of this program ended the " + what;
  try {
    return work();
  } catch (const std::exception& escaped) {
    return fail({.code = Errc::wrong_state, .where = what, .what = ours, .got = escaped.what()});
  } catch (...) {
    return fail({.code = Errc::wrong_state, .where = what, .what = ours});
  }
}

}  // namespace weft::daemon
