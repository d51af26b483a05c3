#pragma once
// Files that come with the programs: sim/*.json in the source tree, PREFIX/share/weft/sim/*.json
// once installed.

#include <filesystem>

namespace weft::daemon {

/// `relative` where it exists from the working folder; else the installed file of that name,
/// PREFIX/share/weft/RELATIVE of the running program PREFIX/bin/NAME; else `relative` as it is.
std::filesystem::path find_installed(const std::filesystem::path& relative);

/// The same for a program in the folder `programs`.
std::filesystem::path find_installed(const std::filesystem::path& relative,
                                     const std::filesystem::path& programs);

}  // namespace weft::daemon
