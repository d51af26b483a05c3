#pragma once
// Which options of `weft evaluate`, `train`, `features` and `design repetitions` say anything about
// which kind of data: the kind is known only when the file is looked at, and no option that was
// typed may go without effect.

#include <set>
#include <string>

#include "protocols/base/result.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

/// Kinds of data, those of sound and vibration by how they are split. One bit each.
enum class DataKind : unsigned {
  slides = 1,          ///< over a tactile array
  imprints = 2,        ///< static ones
  parts = 4,           ///< of recordings, contiguous
  random_windows = 8,  ///< of recordings
  whole_recordings = 16
};

/// Options that were typed, by their first long name.
using GivenOptions = std::set<std::string>;

/// Has every option that `command` has by now note its name in `given` when it is typed. `given`
/// must stay where it is.
void record_given(CLI::App& command, GivenOptions& given);

/// Errors: invalid_argument, one for all options that say nothing about this kind (where: their
/// names), with what to take for them where there is something. An option that nothing is known of
/// is refused for every kind.
Status check_given(const GivenOptions& given, DataKind kind);

}  // namespace weft::daemon::cli
