#pragma once
// Finds files that come with the programs: sim/*.json in the source tree,
// PREFIX/share/weft/sim/*.json after installation.

#include <filesystem>

namespace weft::daemon {

/// `relative` if it exists from the working folder. Otherwise the installed file of that name,
/// PREFIX/share/weft/RELATIVE for the running program PREFIX/bin/NAME. Otherwise `relative`
/// unchanged.
std::filesystem::path find_installed(const std::filesystem::path& relative);

/// The same for a program in the folder `programs`.
std::filesystem::path find_installed(const std::filesystem::path& relative,
                                     const std::filesystem::path& programs);

}  // namespace weft::daemon
