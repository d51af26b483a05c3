#pragma once
// Which program recorded, learnt or reported: what everything that is written says of its maker.

#include <string>

namespace weft::daemon {

/// The commit this program was built from, twelve hexadecimal digits, with ".modified" behind them
/// where the tree had changes that no commit has; empty where it was built outside a git tree.
std::string software_commit();

/// The version with the commit as its build metadata (semver.org, item 10): "0.1.0+g1b2c3d4e5f60",
/// "0.1.0" where no commit is known.
std::string software_version();

}  // namespace weft::daemon
