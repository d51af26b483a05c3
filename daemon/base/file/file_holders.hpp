#pragma once
// Finds other programs with a lock on a file, from the kernel's list.

#include <filesystem>
#include <string>
#include <vector>

namespace weft::daemon {

/// "sqlite3 (process 71)" for every other process with a lock on one of the files, joined by
/// commas; empty if none is seen. Opens none of the files. A deleted file has no holder, and a
/// holder in another container is not seen.
std::string file_holders(const std::vector<std::filesystem::path>& files);

/// Whether another program holds a lock on the file that excludes readers (flock, as HDF5 takes
/// it). Not for a file of SQLite: opening and closing it here would release this process's own
/// locks.
bool is_locked_by_another(const std::filesystem::path& file);

}  // namespace weft::daemon
