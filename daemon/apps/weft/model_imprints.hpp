#pragma once
// `weft classify` on imprints; `weft train` makes their models as it makes those of fabrics.

#include "daemon/apps/weft/console.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

struct ClassifyArgs;

/// `args.model` is one of imprints.
Result<int> run_classify_imprints(const ClassifyArgs& args, Console& console);

}  // namespace weft::daemon::cli
