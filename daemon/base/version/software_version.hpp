#pragma once
// Version of the program, stored with everything that it writes.

#include <string>

namespace weft::daemon {

/// The commit this program was built from: twelve hexadecimal digits, with ".modified" appended if
/// the tree had uncommitted changes. Empty if it was built outside a git tree.
std::string software_commit();

/// The version with the commit as its build metadata (semver.org, item 10): "0.1.0+g1b2c3d4e5f60",
/// or "0.1.0" without a known commit.
std::string software_version();

}  // namespace weft::daemon
